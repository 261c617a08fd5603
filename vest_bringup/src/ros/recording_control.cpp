#include "vest_bringup/ros/recording_control.h"

#include <vest_msgs/SessionState.h>

#include "vest_bringup/ros/recorder.h"
#include "vest_bringup/session/clock_watch.h"

namespace vest::session {
namespace {
constexpr double kLongestEnd = 30.0;  ///< s: a bag of any length closes sooner
}

RecordingControl::RecordingControl(ros::NodeHandle nh, ros::NodeHandle private_nh)
    : nh_(nh), private_nh_(private_nh) {
  ros::NodeHandle service(nh_);
  service.setCallbackQueue(&queue_);
  start_ = service.advertiseService("session/start", &RecordingControl::onStart, this);
  stop_ = service.advertiseService("session/stop", &RecordingControl::onStop, this);
  spinner_.start();
}

bool RecordingControl::leaves(State state, double seconds) const {
  for (double waited = 0; ros::ok() && state_ == state && waited < seconds; waited += 0.01)
    ros::WallDuration(0.01).sleep();
  return state_ != state;
}

bool RecordingControl::onStart(std_srvs::Trigger::Request&, std_srvs::Trigger::Response& res) {
  State idle = State::Idle;
  if (!state_.compare_exchange_strong(idle, State::Starting)) {
    res.success = false;
    res.message = "a session is being recorded already: call session/stop first";
    return true;
  }
  leaves(State::Starting, kLongestEnd);
  res.success = state_ == State::Recording;
  const std::lock_guard<std::mutex> lock(refusal_mutex_);
  res.message = res.success ? "recording" : refusal_;
  return true;
}

bool RecordingControl::onStop(std_srvs::Trigger::Request&, std_srvs::Trigger::Response& res) {
  State recording = State::Recording;
  if (!state_.compare_exchange_strong(recording, State::Stopping)) {
    res.success = false;
    res.message = "nothing is being recorded";
    return true;
  }
  res.success = leaves(State::Stopping, kLongestEnd);
  res.message = res.success ? "the session is closed" : "the bag is still being closed";
  return true;
}

int RecordingControl::run(const std::atomic<bool>& stop) {
  const auto reason = [&]() -> std::string {
    return stop ? "interrupted" : state_ == State::Stopping ? "stopped" : "";
  };
  ros::Publisher status = nh_.advertise<vest_msgs::SessionState>("session/recording", 10);
  for (bool first = true;; first = false) {
    try {
      Recorder recorder(nh_, private_nh_);
      state_ = State::Recording;
      const int code = recorder.run(reason);
      if (state_ != State::Stopping) return code;
    } catch (const std::exception& e) {
      if (first) throw;
      ROS_ERROR("session/start: %s", e.what());
      const std::lock_guard<std::mutex> lock(refusal_mutex_);
      refusal_ = e.what();
    }
    state_ = State::Idle;
    double due = 0;
    while (ros::ok() && !stop && state_ != State::Starting) {
      const double now = steadySeconds();
      if (now >= due) {
        due = now + 0.5;
        vest_msgs::SessionState idle;
        idle.header.stamp = ros::Time::now();
        idle.status = "not recording";
        status.publish(idle);
      }
      ros::WallDuration(0.02).sleep();
    }
    if (!ros::ok() || stop) return 0;
  }
}

}  // namespace vest::session
