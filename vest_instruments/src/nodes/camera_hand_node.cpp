#include <exception>

#include <ros/ros.h>

#include "../nodelets/camera_assistant.h"
#include "vest_instruments/ros/node_help.h"

int main(int argc, char** argv) {
  if (vest::ros_shell::answeredHelp(
          argc, argv,
          "usage: rosrun vest_instruments camera_hand_node [_PARAMETER:=VALUE …]\n"
          "The assistant's camera hand: holds the endoscope, follows, moves in and out by footswitch.\n"
          "Parameters and topics: README.md of vest_instruments."))
    return 0;
  ros::init(argc, argv, "camera_hand");
  ros::NodeHandle keep;  // the last handle ends ROS, and with it the log that carries a refusal
  try {
    vest_instruments::CameraAssistant assistant{ros::NodeHandle(), ros::NodeHandle("~")};
    ros::spin();
  } catch (const std::exception& e) {
    ROS_FATAL("camera_hand: %s", e.what());
    return 1;
  }
  return 0;
}
