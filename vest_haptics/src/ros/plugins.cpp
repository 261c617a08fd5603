#include <pluginlib/class_list_macros.hpp>

#include "vest_haptics/device/force_dimension.h"
#include "vest_haptics/device/impulse_engine.h"
#include "vest_haptics/device/phantom.h"
#include "vest_haptics/device/replay.h"
#include "vest_haptics/device/simulated.h"

PLUGINLIB_EXPORT_CLASS(vest::haptics::SimulatedDevice, vest::haptics::Device)
PLUGINLIB_EXPORT_CLASS(vest::haptics::ReplayDevice, vest::haptics::Device)
PLUGINLIB_EXPORT_CLASS(vest::haptics::PhantomDevice, vest::haptics::Device)
PLUGINLIB_EXPORT_CLASS(vest::haptics::ImpulseEngineDevice, vest::haptics::Device)
PLUGINLIB_EXPORT_CLASS(vest::haptics::ForceDimensionDevice, vest::haptics::Device)
