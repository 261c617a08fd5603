#include <nodelet/nodelet.h>
#include <pluginlib/class_list_macros.hpp>

#include "vest_tissue/ros/tissue_server.h"

namespace vest_tissue {

/// The tissue without effects.
class TissueNodelet : public nodelet::Nodelet {
  void onInit() override {
    try {
      server_ = std::make_unique<vest::ros_shell::TissueServer>(
          getMTNodeHandle(), getPrivateNodeHandle(), [](vest::scene::World world) {
            return std::make_unique<vest::scene::TissueSimulation>(std::move(world));
          });
    } catch (const std::exception& e) {
      NODELET_FATAL("%s", e.what());
      throw;
    }
  }
  std::unique_ptr<vest::ros_shell::TissueServer> server_;
};

}  // namespace vest_tissue

PLUGINLIB_EXPORT_CLASS(vest_tissue::TissueNodelet, nodelet::Nodelet)
