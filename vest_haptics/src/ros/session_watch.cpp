#include "session_watch.h"

#include <algorithm>
#include <cmath>
#include <thread>

#include <ros/ros.h>

#include "vest_haptics/loop/loop.h"

namespace vest::ros_shell {
namespace {

double clockOffset() {
  return ros::WallTime::now().toSec() - 1e-9 * static_cast<double>(haptics::Loop::steadyNow());
}

}  // namespace

SessionWatch::SessionWatch(std::string who) : who_(std::move(who)) {
  offset_ = clockOffset();
  master_->answered = looked_ = awake_ = haptics::Loop::steadyNow();
  std::thread([master = master_] {
    while (!master->stop) {
      const bool there = ros::master::check();  // may hang with the master
      if (there) master->answered = haptics::Loop::steadyNow();
      master->refused = !there;
      for (int i = 0; i < 10 && !master->stop; ++i) ros::WallDuration(0.1 * kAsk).sleep();
    }
    master->ended = true;
  }).detach();
}

SessionWatch::~SessionWatch() {
  master_->stop = true;
  for (int i = 0; i < 100 && !master_->ended; ++i) ros::WallDuration(0.01).sleep();
}

void SessionWatch::look() {
  const std::int64_t now = haptics::Loop::steadyNow();
  // A process that was put aside heard no answer.
  if (1e-9 * static_cast<double>(now - looked_) > kAside) awake_ = now;
  looked_ = now;
  const double silent = 1e-9 * static_cast<double>(now - std::max<std::int64_t>(master_->answered, awake_));
  const bool lost = master_->refused || silent > kPatience;
  if (lost && !lost_)
    ROS_ERROR(
        "%s: ROS master lost (%s). This session goes on; nothing can join it until it is ended and "
        "started anew",
        who_.c_str(), ros::master::getURI().c_str());
  if (!lost && lost_)
    ROS_WARN(
        "%s: a ROS master answers again. Where it was started anew it knows nothing of this session, "
        "which goes on: end it before the next",
        who_.c_str());
  lost_ = lost;
  const double step = clockOffset() - offset_;
  if (std::abs(step) > kStep) {
    ROS_WARN("%s: the system clock was set by %+.1f s; stamps follow it, forces go by the steady clock",
             who_.c_str(), step);
    clock_step_ += step;
    offset_ += step;
  }
}

}  // namespace vest::ros_shell
