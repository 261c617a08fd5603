#include <exception>

#include <ros/ros.h>

#include "../nodelets/instruments.h"

int main(int argc, char** argv) {
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
