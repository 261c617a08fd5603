#include <nodelet/nodelet.h>
#include <pluginlib/class_list_macros.hpp>

#include "vest_bringup/simulation/trainer.h"
#include "vest_tissue/ros/tissue_server.h"

namespace vest_bringup {

/// The Trainer composite behind topics and services (docs/ros_interface.md).
class TrainerNodelet : public nodelet::Nodelet {
  void onInit() override {
    try {
      server_ = std::make_unique<vest::ros_shell::TissueServer>(
          getMTNodeHandle(), getPrivateNodeHandle(), [](vest::scene::World world) {
            return std::make_unique<vest::simulation::Trainer>(std::move(world));
          });
    } catch (const std::exception& e) {
      NODELET_FATAL("%s", e.what());
      throw;
    }
  }
  std::unique_ptr<vest::ros_shell::TissueServer> server_;
};

}  // namespace vest_bringup

PLUGINLIB_EXPORT_CLASS(vest_bringup::TrainerNodelet, nodelet::Nodelet)
