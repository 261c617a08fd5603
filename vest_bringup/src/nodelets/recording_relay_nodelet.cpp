#include <memory>

#include <nodelet/nodelet.h>
#include <pluginlib/class_list_macros.hpp>

#include "vest_bringup/ros/recording_relay.h"

namespace vest_bringup {

/// RecordingRelay beside the nodelets whose messages it hands on.
class RecordingRelayNodelet : public nodelet::Nodelet {
  void onInit() override { relay_ = std::make_unique<vest::session::RecordingRelay>(getMTNodeHandle()); }
  std::unique_ptr<vest::session::RecordingRelay> relay_;
};

}  // namespace vest_bringup

PLUGINLIB_EXPORT_CLASS(vest_bringup::RecordingRelayNodelet, nodelet::Nodelet)
