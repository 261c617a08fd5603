#include <exception>

#include <ros/ros.h>

#include "../nodelets/camera_assistant.h"

int main(int argc, char** argv) {
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
