// The driver as a program of its own.
#include "../ros/phantom_box_shell.h"
#include "vest_instruments/ros/node_help.h"

#include <atomic>
#include <csignal>

namespace {

std::atomic<vest::ros_shell::PhantomBoxShell*> running{nullptr};
// The emulated box ends at the same moment: that it hangs up is no news then.
void onSignal(int) {
  if (auto* const shell = running.load()) shell->fallSilent();
  ros::requestShutdown();
}

}  // namespace

int main(int argc, char** argv) {
  if (vest::ros_shell::answeredHelp(
          argc, argv,
          "usage: rosrun vest_hw_phantom_box phantom_box _port:=/dev/ttyUSB0 [_PARAMETER:=VALUE …]\n"
          "Driver of a trainer box on a serial port.\n"
          "Parameters and topics: README.md of vest_hw_phantom_box."))
    return 0;
  ros::init(argc, argv, "phantom_box", ros::init_options::NoSigintHandler);
  ros::NodeHandle nh;
  try {
    vest::ros_shell::PhantomBoxShell shell(nh, ros::NodeHandle("~"));
    running = &shell;
    std::signal(SIGINT, onSignal);
    std::signal(SIGTERM, onSignal);
    ros::spin();
    running = nullptr;
  } catch (const std::exception& e) {
    ROS_FATAL("phantom_box: %s", e.what());
    return 1;
  }
  return 0;
}
