#include <pluginlib/class_list_macros.hpp>

#include "vest_haptics/device/replay.h"
#include "vest_haptics/device/simulated.h"

PLUGINLIB_EXPORT_CLASS(vest::haptics::SimulatedDevice, vest::haptics::Device)
PLUGINLIB_EXPORT_CLASS(vest::haptics::ReplayDevice, vest::haptics::Device)
