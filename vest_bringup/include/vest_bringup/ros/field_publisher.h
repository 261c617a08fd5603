#pragma once

#include <atomic>
#include <memory>
#include <mutex>
#include <thread>

#include <ros/ros.h>

#include "vest_bringup/ros/field_messages.h"

namespace vest::ros_shell {

/// Parameters of the operating field below a handle: fluid/…, smoke/…, lens/… (vest_effects/README.md).
/// @throws std::invalid_argument naming parameter, value and what is allowed
simulation::FieldOptions fieldOptions(const ros::NodeHandle& nh);

/// Publishes effects/fluid, effects/smoke, effects/lens and effects/impacts whenever there is a new frame, in
/// a thread of its own, and tells /diagnostics once a second.
class FieldPublisher {
 public:
  explicit FieldPublisher(ros::NodeHandle nh);
  ~FieldPublisher();
  /// From now on these frames. Any thread.
  void show(std::shared_ptr<simulation::FieldFrames> frames);

 private:
  void loop();
  void publish(const simulation::FieldFrame& frame, const ros::Time& stamp);
  void diagnose(const simulation::FieldFrame& frame);

  ros::NodeHandle nh_;
  ros::Publisher fluid_, smoke_, lens_, impacts_, diagnostics_;
  std::mutex mutex_;
  std::shared_ptr<simulation::FieldFrames> frames_;
  bool degraded_ = false;
  std::uint64_t dropped_seen_ = 0, refused_seen_ = 0;  ///< told already
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

}  // namespace vest::ros_shell
