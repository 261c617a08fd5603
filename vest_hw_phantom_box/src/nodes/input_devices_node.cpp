// Pedals and gamepads on USB, as an input map names them.
#include "../ros/input_shell.h"

int main(int argc, char** argv) {
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
