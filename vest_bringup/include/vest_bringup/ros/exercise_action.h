#pragma once

#include <atomic>

#include <actionlib/server/simple_action_server.h>
#include <vest_msgs/ExerciseAction.h>
#include <vest_msgs/SessionState.h>

#include "vest_bringup/ros/exercise_shell.h"

namespace vest::ros_shell {

/// Action session/exercise: gives the hands their tools, loads the exercise's scene, tells how it goes at
/// 20 Hz, and ends with the score. A goal that cannot be is aborted with one sentence, and the scene that ran
/// goes on.
class ExerciseAction {
 public:
  /// @param shell outlives it
  ExerciseAction(const ros::NodeHandle& nh, ExerciseShell& shell);
  ~ExerciseAction();

 private:
  using Server = actionlib::SimpleActionServer<vest_msgs::ExerciseAction>;
  void execute(const vest_msgs::ExerciseGoalConstPtr& goal);
  /// Until it is over. @return whether it was finished
  bool follow(const vest_msgs::ExerciseGoal& goal, std::uint64_t attempt);
  void end(const std::string& problem);
  void giveTools(const exercise::Exercise& exercise);
  /// @param words how the trainee gets on, or why the result is not kept
  void keep(const exercise::Exercise& exercise, const std::string& trainee, std::string& words) const;
  void onState(const vest_msgs::SessionState& state);

  ros::NodeHandle nh_;
  ExerciseShell& shell_;
  ros::Subscriber state_sub_;
  std::mutex mutex_;  ///< directory_
  std::string directory_;
  std::atomic<bool> off_pace_{false};  ///< the simulation was paused, too slow or too fast
  std::atomic<bool> stop_{false};
  Server server_;  // last: its thread uses what stands above
};

}  // namespace vest::ros_shell
