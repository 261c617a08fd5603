#include <atomic>
#include <csignal>

#include <ros/ros.h>

#include "vest_bringup/ros/recording_control.h"

namespace {
std::atomic<bool> stop{false};
}

int main(int argc, char** argv) {
  ros::init(argc, argv, "recorder", ros::init_options::NoSigintHandler);
  std::signal(SIGINT, [](int) { stop = true; });
  std::signal(SIGTERM, [](int) { stop = true; });
  ros::NodeHandle nh;  // outlives a refusal: the last handle ends ROS and its log
  try {
    return vest::session::RecordingControl(nh, ros::NodeHandle("~")).run(stop);
  } catch (const std::exception& e) {
    ROS_FATAL("recorder: %s", e.what());
    return 1;
  }
}
