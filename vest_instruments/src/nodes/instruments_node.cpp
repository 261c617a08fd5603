#include <memory>

#include "../nodelets/instruments.h"
#include "vest_instruments/ros/node_help.h"

int main(int argc, char** argv) {
  return vest::ros_shell::runNode(
      argc, argv, "instruments",
      "usage: rosrun vest_instruments instruments_node [_PARAMETER:=VALUE …]\n"
      "Instruments in their trocars, without tissue; the node behind instruments.launch.\n"
      "Parameters and topics: README.md of vest_instruments.",
      [] {
        return std::make_unique<vest_instruments::Instruments>(ros::NodeHandle(), ros::NodeHandle("~"));
      });
}
