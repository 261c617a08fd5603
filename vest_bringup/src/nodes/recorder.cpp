#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <thread>

#include <ros/ros.h>

#include "vest_bringup/ros/recording_control.h"
#include "vest_instruments/ros/node_help.h"

namespace {

std::atomic<bool> stop{false};

/// roscpp would wait for a master for ever, deaf to signals. @return false: told to stop before there was one
bool waitForMaster() {
  for (int tenth = 0; !ros::master::check(); ++tenth) {
    if (tenth == 0)
      std::fprintf(stderr, "recorder: waiting for the ROS master at %s\n", ros::master::getURI().c_str());
    if (stop) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
  }
  return !stop;
}

}  // namespace

int main(int argc, char** argv) {
  if (vest::ros_shell::answeredHelp(
          argc, argv,
          "usage: rosrun vest_bringup recorder _directory:=FOLDER [_seconds:=S] [_PARAMETER:=VALUE …]\n"
          "Records a session: FOLDER gets session.bag, session.json and pictures. SIGINT closes it.\n"
          "Parameters: README.md of vest_bringup."))
    return 0;
  // With private parameters roscpp waits for a master within init(), deaf to a flag: there is nothing to
  // close yet, so that a signal may end the process at once.
  std::signal(SIGINT, SIG_DFL);
  std::signal(SIGTERM, SIG_DFL);
  ros::init(argc, argv, "recorder", ros::init_options::NoSigintHandler);
  std::signal(SIGINT, [](int) { stop = true; });
  std::signal(SIGTERM, [](int) { stop = true; });
  if (!waitForMaster()) return 0;
  ros::NodeHandle nh;  // outlives a refusal: the last handle ends ROS and its log
  try {
    nh.deleteParam("session/recorder_refused");
    return vest::session::RecordingControl(nh, ros::NodeHandle("~")).run(stop);
  } catch (const std::exception& e) {
    ROS_FATAL("recorder: %s", e.what());
    nh.setParam("session/recorder_refused", e.what());  // who waits for a recorder need not wait longer
    return 1;
  }
}
