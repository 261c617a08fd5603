#include <sys/mman.h>

#include <csignal>
#include <cstdio>

#include <ros/ros.h>

#include "../ros/haptic_shell.h"

namespace {
vest::haptics::Loop* volatile running = nullptr;
// Force goes at the next tick; roscpp's own handler would take up to 100 ms to be noticed.
void onSignal(int) {
  if (running) running->halt();
  ros::requestShutdown();
}
}  // namespace

int main(int argc, char** argv) {
  ros::init(argc, argv, "haptics", ros::init_options::NoSigintHandler);
  ::mlockall(MCL_CURRENT | MCL_FUTURE);  // no page faults in the loop where the machine grants it
  try {
    vest::ros_shell::HapticShell shell(ros::NodeHandle(), ros::NodeHandle("~"));
    running = &shell.loop();
    std::signal(SIGINT, onSignal);
    std::signal(SIGTERM, onSignal);
    std::signal(SIGHUP, onSignal);
    ros::spin();
    running = nullptr;
  } catch (const std::exception& e) {
    std::fprintf(stderr, "haptics: %s\n", e.what());
    return 2;
  }
  return 0;
}
