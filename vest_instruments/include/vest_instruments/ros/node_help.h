#pragma once

#include <cstdio>
#include <cstring>
#include <exception>

#include <ros/ros.h>

namespace vest::ros_shell {

/// Prints `text` where the command line asks for it (-h, --help), and says whether it did. Nodes ask this
/// before they look for a ROS master.
inline bool answeredHelp(int argc, char** argv, const char* text) {
  for (int i = 1; i < argc; ++i) {
    if (std::strcmp(argv[i], "-h") != 0 && std::strcmp(argv[i], "--help") != 0) continue;
    std::puts(text);
    return true;
  }
  return false;
}

/// main() of a node: answers --help with `help`, then spins while what `start` returned lives.
/// @param name of the node; a std::exception is logged behind it
/// @return exit status: 1 where `start` threw
template <class Start>
int runNode(int argc, char** argv, const char* name, const char* help, Start start) {
  if (answeredHelp(argc, argv, help)) return 0;
  ros::init(argc, argv, name);
  ros::NodeHandle keep;  // the last handle ends ROS, and with it the log that carries a refusal
  try {
    [[maybe_unused]] const auto running = start();
    ros::spin();
  } catch (const std::exception& e) {
    ROS_FATAL("%s: %s", name, e.what());
    return 1;
  }
  return 0;
}

}  // namespace vest::ros_shell
