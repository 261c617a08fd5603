#pragma once

#include <cstdio>
#include <cstring>

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

}  // namespace vest::ros_shell
