#pragma once

#include <mutex>
#include <string>

#include <geometry_msgs/PoseStamped.h>
#include <ros/callback_queue.h>
#include <ros/ros.h>
#include <sensor_msgs/JointState.h>
#include <sensor_msgs/Joy.h>

#include <Eigen/Geometry>

namespace vest::displays {

/// Sends pose, jaw and switches of a teleoperated instrument 50 times a second from a thread of its own,
/// since a frame that takes long to draw must not look like a hand that went away. A window that stands still
/// for longer than kPatience sends nothing more: pedals then count as released.
class TeleopSender {
 public:
  static constexpr double kPatience = 0.5;  ///< s, assumed: a few slow frames
  static constexpr int kSwitches = 6;

  explicit TeleopSender(const ros::NodeHandle& handle);
  ~TeleopSender();
  TeleopSender(const TeleopSender&) = delete;
  TeleopSender& operator=(const TeleopSender&) = delete;

  /// Whose topics teleop/NAME/… are used; nothing is sent before set().
  void choose(const std::string& instrument);
  /// @param moves false: switches alone, for another source moves the instrument. @param switches bit i:
  /// footswitch i is down
  void set(bool moves, const Eigen::Isometry3d& X_BTip, double jaw, std::uint32_t switches);

 private:
  void send();

  ros::NodeHandle handle_;
  ros::CallbackQueue queue_;
  std::mutex mutex_;
  ros::Publisher pose_publisher_, jaw_publisher_, switches_publisher_;
  geometry_msgs::PoseStamped pose_;
  sensor_msgs::JointState jaw_;
  sensor_msgs::Joy joy_;
  ros::SteadyTime set_;
  bool moves_ = false;
  ros::SteadyTimer timer_;
  ros::AsyncSpinner spinner_;
};

}  // namespace vest::displays
