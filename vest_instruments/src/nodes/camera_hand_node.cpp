#include <memory>

#include "../nodelets/camera_assistant.h"
#include "vest_instruments/ros/node_help.h"

int main(int argc, char** argv) {
  return vest::ros_shell::runNode(
      argc, argv, "camera_hand",
      "usage: rosrun vest_instruments camera_hand_node [_PARAMETER:=VALUE …]\n"
      "The assistant's camera hand: holds the endoscope, follows, moves in and out by footswitch.\n"
      "Parameters and topics: README.md of vest_instruments.",
      [] {
        return std::make_unique<vest_instruments::CameraAssistant>(ros::NodeHandle(), ros::NodeHandle("~"));
      });
}
