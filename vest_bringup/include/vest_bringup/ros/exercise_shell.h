#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <string>

#include <ros/node_handle.h>
#include <ros/publisher.h>
#include <vest_msgs/SessionScore.h>

#include "vest_bringup/exercise/engine.h"
#include "vest_tissue/ros/tissue_server.h"

namespace vest::ros_shell {

/// The exercise that is done, of ~exercise or chosen later, as topics (docs/ros_interface.md):
/// session/exercise_file and session/result (latched), session/score, session/instruction and session/targets
/// (latched).
class ExerciseShell {
 public:
  using Chosen = std::shared_ptr<const exercise::Exercise>;

  /// @throws std::invalid_argument naming the parameter or the exercise's file
  ExerciseShell(ros::NodeHandle nh, const ros::NodeHandle& private_nh);
  /// Adds the exercise where the stage has its scene, and begins anew. @throws what the engine throws
  void attach(simulation::Stage& stage);
  /// By the publishing thread.
  void publish(const ros::Time& now);

  /// The exercise of the scenes that are loaded from now on, by name or file. @throws std::invalid_argument
  Chosen choose(const std::string& exercise);
  /// What was chosen before, where its scene was refused; null: none.
  void choose(const Chosen& exercise);
  Chosen chosen() const;
  /// Grows with each scene that is loaded.
  std::uint64_t attempt() const;

  /// What was published last.
  struct Told {
    std::uint64_t attempt = 0;  ///< of what is below
    vest_msgs::SessionScore score;
    std::string instruction;
    exercise::Result result;
  };
  Told told() const;

 private:
  void publishText(const ros::Publisher& publisher, const std::string& text, const ros::Time& now) const;

  ros::Publisher file_pub_, score_pub_, instruction_pub_, targets_pub_, result_pub_;
  mutable std::mutex mutex_;  ///< of what follows
  Chosen exercise_;           ///< null: none
  std::shared_ptr<exercise::Progress> progress_;
  std::uint64_t attempt_ = 0;
  Told told_;
  // Of the publishing thread.
  std::string instruction_;
  bool finished_told_ = false;
};

}  // namespace vest::ros_shell
