#include <exception>

#include <ros/ros.h>

#include "../nodelets/instruments.h"
#include "vest_instruments/ros/node_help.h"

int main(int argc, char** argv) {
  if (vest::ros_shell::answeredHelp(
          argc, argv,
          "usage: rosrun vest_instruments instruments_node [_PARAMETER:=VALUE …]\n"
          "Instruments in their trocars, without tissue; the node behind instruments.launch.\n"
          "Parameters and topics: README.md of vest_instruments."))
    return 0;
  ros::init(argc, argv, "instruments");
  ros::NodeHandle keep;  // the last handle ends ROS, and with it the log that carries a refusal
  try {
    vest_instruments::Instruments instruments{ros::NodeHandle(), ros::NodeHandle("~")};
    ros::spin();
  } catch (const std::exception& e) {
    ROS_FATAL("instruments: %s", e.what());
    return 1;
  }
  return 0;
}
