// The driver as a program of its own.
#include "../ros/phantom_box_shell.h"

int main(int argc, char** argv) {
  ros::init(argc, argv, "phantom_box");
  ros::NodeHandle nh;
  try {
    const vest::ros_shell::PhantomBoxShell shell(nh, ros::NodeHandle("~"));
    ros::spin();
  } catch (const std::exception& e) {
    ROS_FATAL("phantom_box: %s", e.what());
    return 1;
  }
  return 0;
}
