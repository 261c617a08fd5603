#pragma once

#include <array>
#include <string>
#include <vector>

#include <ros/node_handle.h>

#include "vest_instruments/control/input_map.h"

namespace vest_instruments {

/// Parameters of the node, read once and checked.
struct Configuration {
  vest::kinematics::TrainerBox box;
  /// Who moves what, and what switches do: the file ~inputs, or else ~sources, ~tool_pedal_instrument and
  /// what the session says of the footswitches (ros/footswitches.h).
  vest::control::InputMap inputs;
  std::string footswitch_preset;  ///< as the session had it at the start
  /// What the pedal hands over, press by press, round and round; empty: every tool in the order of ToolKind.
  std::vector<vest::tools::ToolKind> tool_tray;
  Eigen::Isometry3d X_WB = Eigen::Isometry3d::Identity();  ///< phantom_box in world: ~tilt
  std::string type_package;                                ///< vest_msgs or crtk_msgs
  bool set_robot_description = true;
};

/// @throws std::runtime_error that names parameter, value and what is allowed
[[noreturn]] void refuse(const ros::NodeHandle& nh, const std::string& name, const std::string& value,
                         const std::string& allowed);

/// Absent: `otherwise`. Present with another type: refused (roscpp would silently take the default).
template <class T>
T read(const ros::NodeHandle& nh, const std::string& name, const T& otherwise, const char* type) {
  if (!nh.hasParam(name)) return otherwise;
  T value;
  if (!nh.getParam(name, value)) refuse(nh, name, "has a wrong type", type);
  return value;
}

/// @param nh of the session's namespace
/// @throws std::runtime_error that names parameter, value and what is allowed.
Configuration readConfiguration(const ros::NodeHandle& nh, const ros::NodeHandle& private_nh);

}  // namespace vest_instruments
