#pragma once

#include <atomic>
#include <mutex>
#include <string>

#include <ros/callback_queue.h>
#include <ros/ros.h>
#include <std_srvs/Trigger.h>

namespace vest::session {

/// Records from the start on, and again on request: services session/start and session/stop. A recording that
/// begins beside a running simulation starts with a snapshot of its State.
class RecordingControl {
 public:
  RecordingControl(ros::NodeHandle nh, ros::NodeHandle private_nh);

  /// Until `stop` becomes true, the wished time is over, or ROS ends. After session/stop it waits for
  /// session/start. @return exit code
  /// @throws std::invalid_argument, std::runtime_error naming parameter or file, of the first recording
  int run(const std::atomic<bool>& stop);

 private:
  enum class State { Recording, Idle, Starting, Stopping };
  bool onStart(std_srvs::Trigger::Request& req, std_srvs::Trigger::Response& res);
  bool onStop(std_srvs::Trigger::Request& req, std_srvs::Trigger::Response& res);
  /// Waits until the state is no longer this one. False after `seconds`.
  bool leaves(State state, double seconds) const;

  ros::NodeHandle nh_, private_nh_;
  ros::CallbackQueue queue_;
  ros::AsyncSpinner spinner_{1, &queue_};
  ros::ServiceServer start_, stop_;
  std::atomic<State> state_{State::Starting};
  std::mutex refusal_mutex_;
  std::string refusal_;  ///< why the last start failed; empty: it did not
};

}  // namespace vest::session
