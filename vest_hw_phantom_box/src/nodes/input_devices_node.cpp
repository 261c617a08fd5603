// Pedals and gamepads on USB, as an input map names them.
#include "../ros/input_shell.h"
#include "vest_instruments/ros/node_help.h"

int main(int argc, char** argv) {
  if (vest::ros_shell::answeredHelp(argc, argv,
                                    "usage: rosrun vest_hw_phantom_box input_devices _inputs:=MAP.yaml\n"
                                    "Pedals and gamepads on USB, as an input map names them.\n"
                                    "Parameters and topics: README.md of vest_hw_phantom_box; input maps: "
                                    "README.md of vest_instruments."))
    return 0;
  ros::init(argc, argv, "input_devices");
  ros::NodeHandle nh;
  try {
    const vest::ros_shell::InputShell shell(nh, ros::NodeHandle("~"));
    ros::spin();
  } catch (const std::exception& e) {
    ROS_FATAL("input_devices: %s", e.what());
    return 1;
  }
  return 0;
}
