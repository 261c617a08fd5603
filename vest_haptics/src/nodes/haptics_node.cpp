#include <sys/mman.h>
#include <unistd.h>

#include <csignal>
#include <cstdio>

#include <ros/ros.h>

#include "../ros/haptic_shell.h"
#include "vest_instruments/ros/node_help.h"

namespace {
vest::haptics::Loop* volatile running = nullptr;
constexpr unsigned kLongestEnd = 5;  // s, assumed: roslaunch kills after 15

// Force goes at the next tick; roscpp's own handler would take up to 100 ms to be noticed. A call of the
// device that never comes back must not keep the process from ending, nor one that a command has made.
void onSignal(int) {
  if (running) running->halt();
  ros::requestShutdown();
  ::alarm(kLongestEnd);
}

void onStuck(int) {
  constexpr char kText[] =
      "haptics: not ended within 5 s (a call of the device hangs, or the machine is busy): ended without "
      "it\n";
  if (::write(STDERR_FILENO, kText, sizeof kText - 1) < 0) ::_exit(4);
  ::_exit(3);
}
}  // namespace

int main(int argc, char** argv) {
  if (vest::ros_shell::answeredHelp(
          argc, argv,
          "usage: rosrun vest_haptics haptics _instrument:=left _device:=sim [_PARAMETER:=VALUE …]\n"
          "Force feedback of one haptic device; ends the session that it belongs to if it fails. As "
          "device.launch starts it.\n"
          "Parameters and topics: README.md of vest_haptics."))
    return 0;
  ros::init(argc, argv, "haptics", ros::init_options::NoSigintHandler);
  ::mlockall(MCL_CURRENT | MCL_FUTURE);  // no page faults in the loop where the machine grants it
  try {
    // Before any handle: the master would tell a process of the same name to end, with the hand in the
    // tissue.
    const auto alone = vest::ros_shell::holdHand();
    vest::ros_shell::HapticShell shell(ros::NodeHandle(), ros::NodeHandle("~"), alone.get());
    running = &shell.loop();
    std::signal(SIGALRM, onStuck);
    std::signal(SIGINT, onSignal);
    std::signal(SIGTERM, onSignal);
    std::signal(SIGHUP, onSignal);
    ros::spin();
    running = nullptr;
    ::alarm(kLongestEnd);
  } catch (const std::exception& e) {
    std::fprintf(stderr, "haptics: %s\n", e.what());
    return 2;
  } catch (...) {
    std::fprintf(stderr, "haptics: the device threw something that is no std::exception\n");
    return 2;
  }
  return 0;
}
