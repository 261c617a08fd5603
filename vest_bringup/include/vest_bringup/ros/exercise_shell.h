#pragma once

#include <memory>
#include <mutex>
#include <string>

#include <ros/node_handle.h>
#include <ros/publisher.h>

#include "vest_bringup/exercise/engine.h"
#include "vest_tissue/ros/tissue_server.h"

namespace vest::ros_shell {

/// The exercise of ~exercise as topics (docs/ros_interface.md): session/exercise_file and session/result
/// (latched), session/score, session/instruction and session/targets (latched).
class ExerciseShell {
 public:
  /// @throws std::invalid_argument naming the parameter or the exercise's file
  ExerciseShell(ros::NodeHandle nh, const ros::NodeHandle& private_nh);
  /// Adds the exercise where the stage has its scene, and begins anew. @throws what the engine throws
  void attach(simulation::Stage& stage);
  /// By the publishing thread.
  void publish(const ros::Time& now);

 private:
  void publishText(const ros::Publisher& publisher, const std::string& text, const ros::Time& now) const;

  std::unique_ptr<exercise::Exercise> exercise_;  ///< null: none
  std::string file_text_;
  ros::Publisher file_pub_, score_pub_, instruction_pub_, targets_pub_, result_pub_;
  std::mutex mutex_;  ///< progress_
  std::shared_ptr<exercise::Progress> progress_;
  // Of the publishing thread.
  std::string instruction_;
  bool told_ = false;
};

}  // namespace vest::ros_shell
