#pragma once

#include <vest_msgs/FluidState.h>
#include <vest_msgs/Impacts.h>
#include <vest_msgs/LensState.h>
#include <vest_msgs/SmokeState.h>

#include "vest_bringup/simulation/operating_field.h"

/// The operating field as messages. Headers are the caller's, but for frame_id.
namespace vest::ros_shell {

void toMsg(const simulation::FieldFrame& frame, vest_msgs::FluidState& msg);
void toMsg(const simulation::FieldFrame& frame, vest_msgs::SmokeState& msg);
void toMsg(const simulation::FieldFrame& frame, vest_msgs::LensState& msg);
void toMsg(const simulation::FieldFrame& frame, vest_msgs::Impacts& msg);

}  // namespace vest::ros_shell
