// Pedals and gamepads on USB, as an input map names them.
#include <memory>

#include "../ros/input_shell.h"
#include "vest_instruments/ros/node_help.h"

int main(int argc, char** argv) {
  return vest::ros_shell::runNode(
      argc, argv, "input_devices",
      "usage: rosrun vest_hw_phantom_box input_devices _inputs:=MAP.yaml\n"
      "Pedals and gamepads on USB, as an input map names them.\n"
      "Parameters and topics: README.md of vest_hw_phantom_box; input maps: README.md of vest_instruments.",
      [] { return std::make_unique<vest::ros_shell::InputShell>(ros::NodeHandle(), ros::NodeHandle("~")); });
}
