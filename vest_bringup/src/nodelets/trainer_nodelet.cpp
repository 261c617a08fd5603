#include <nodelet/nodelet.h>
#include <pluginlib/class_list_macros.hpp>

#include "vest_bringup/ros/field_publisher.h"
#include "vest_bringup/simulation/trainer.h"
#include "vest_tissue/ros/tissue_server.h"

namespace vest_bringup {

/// The Trainer composite behind topics and services (docs/ros_interface.md).
class TrainerNodelet : public nodelet::Nodelet {
  void onInit() override {
    try {
      const vest::simulation::FieldOptions field = vest::ros_shell::fieldOptions(getPrivateNodeHandle());
      field_ = std::make_unique<vest::ros_shell::FieldPublisher>(getMTNodeHandle());
      server_ = std::make_unique<vest::ros_shell::TissueServer>(
          getMTNodeHandle(), getPrivateNodeHandle(), [this, field](vest::scene::World world) {
            auto frames = std::make_shared<vest::simulation::FieldFrames>();
            auto effect = std::make_unique<vest::simulation::OperatingField>(world, field, frames);
            auto trainer = std::make_unique<vest::simulation::Trainer>(std::move(world));
            trainer->add(std::move(effect));
            field_->show(std::move(frames));
            return trainer;
          });
    } catch (const std::exception& e) {
      NODELET_FATAL("%s", e.what());
      throw;
    }
  }
  std::unique_ptr<vest::ros_shell::FieldPublisher> field_;  ///< outlives the server, whose factory uses it
  std::unique_ptr<vest::ros_shell::TissueServer> server_;
};

}  // namespace vest_bringup

PLUGINLIB_EXPORT_CLASS(vest_bringup::TrainerNodelet, nodelet::Nodelet)
