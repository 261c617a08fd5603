#include <nodelet/nodelet.h>
#include <pluginlib/class_list_macros.hpp>

#include "vest_bringup/ros/effects_shell.h"
#include "vest_bringup/ros/recording_relay.h"

namespace vest_bringup {

/// The Trainer composite behind topics and services (docs/ros_interface.md).
class TrainerNodelet : public nodelet::Nodelet {
  void onInit() override {
    using vest::ros_shell::TissueServer;
    try {
      effects_ = std::make_unique<vest::ros_shell::EffectsShell>(getMTNodeHandle(), getPrivateNodeHandle());
      server_ = std::make_unique<TissueServer>(
          getMTNodeHandle(), getPrivateNodeHandle(),
          [this](vest::scene::World world) { return effects_->compose(std::move(world)); },
          [this](const TissueServer::Stamp& stamp) { effects_->publish(stamp); });
      relay_ = std::make_unique<vest::session::RecordingRelay>(getMTNodeHandle());
    } catch (const std::exception& e) {
      NODELET_FATAL("%s", e.what());
      throw;
    }
  }
  std::unique_ptr<vest::ros_shell::EffectsShell> effects_;  // outlives the server
  std::unique_ptr<vest::ros_shell::TissueServer> server_;
  std::unique_ptr<vest::session::RecordingRelay> relay_;
};

}  // namespace vest_bringup

PLUGINLIB_EXPORT_CLASS(vest_bringup::TrainerNodelet, nodelet::Nodelet)
