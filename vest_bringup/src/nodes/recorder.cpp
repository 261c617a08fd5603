#include <atomic>
#include <csignal>

#include <ros/ros.h>

#include "vest_bringup/ros/recording_control.h"
#include "vest_instruments/ros/node_help.h"

namespace {
std::atomic<bool> stop{false};
}

int main(int argc, char** argv) {
  if (vest::ros_shell::answeredHelp(
          argc, argv,
          "usage: rosrun vest_bringup recorder _directory:=FOLDER [_seconds:=S] [_PARAMETER:=VALUE …]\n"
          "Records a session: FOLDER gets session.bag, session.json and pictures. SIGINT closes it.\n"
          "Parameters: README.md of vest_bringup."))
    return 0;
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
