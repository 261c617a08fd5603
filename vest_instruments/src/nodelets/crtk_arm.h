#pragma once

#include <functional>
#include <string>

#include <geometry_msgs/PoseStamped.h>
#include <geometry_msgs/TwistStamped.h>
#include <geometry_msgs/WrenchStamped.h>
#include <ros/ros.h>
#include <sensor_msgs/JointState.h>
#include <std_msgs/Empty.h>
#include <vest_msgs/OperatingState.h>
#include <vest_msgs/StringStamped.h>

#include "vest_instruments/control/instrument.h"

namespace vest_instruments {

/// CRTK topics of one instrument: converts and publishes, decides nothing.
class CrtkArm {
 public:
  using Clock = std::function<double()>;  ///< steady time, s

  /// @param hand namespace of the topics of the source `teleop`: teleop, or gamepad where the input map says
  /// so
  /// @param type_package package named in the wire type of operating_state and state_command (same MD5 either
  /// way)
  CrtkArm(ros::NodeHandle& nh, const std::string& name, vest::control::Instrument& instrument,
          const std::string& hand, const std::string& type_package, Clock clock);

  /// measured_*, setpoint_*: only what somebody listens to.
  void publish(const ros::Time& stamp);
  /// Latched, at every change.
  void publishStateIfChanged(const ros::Time& stamp);
  /// Force of the tissue on the instrument, in phantom_box.
  void publishForce(const geometry_msgs::WrenchStamped& force);
  std::uint64_t refused() const { return refused_; }
  const std::string& name() const { return name_; }

 private:
  template <class M, class F>
  void listen(ros::NodeHandle& nh, const std::string& topic, F handler);
  void refuse(const std::string& topic, const std::string& reason);
  void take(const std::string& topic, vest::control::Verdict verdict);
  bool dated(const std::string& topic, const std_msgs::Header& header);
  /// Joint values from names or, without names, by order; what is not named keeps its setpoint.
  bool joints(const std::string& topic, const sensor_msgs::JointState& msg, vest::control::Joints& q,
              bool& has_fifth);
  void onPose(const std::string& topic, const geometry_msgs::PoseStamped& msg, bool move,
              vest::control::Source source);
  void onJaw(const std::string& topic, const sensor_msgs::JointState& msg, vest::control::Source source);

  std::string name_;
  vest::control::Instrument& instrument_;
  Clock clock_;
  ros::Publisher measured_js_, setpoint_js_, measured_cp_, setpoint_cp_, measured_cv_, measured_cf_, jaw_,
      operating_state_;
  std::vector<ros::Subscriber> subscribers_;
  sensor_msgs::JointState js_, jaw_js_;
  geometry_msgs::PoseStamped cp_;
  geometry_msgs::TwistStamped cv_;
  std::uint32_t published_revision_ = ~0u;
  std::uint64_t refused_ = 0;
  bool endoscope_;
};

/// Isometry to message.
geometry_msgs::Pose toPose(const Eigen::Isometry3d& X);
/// Message to isometry; false where not finite or the quaternion is no rotation (norm off 1 by more than 1
/// %).
bool fromPose(const geometry_msgs::Pose& pose, Eigen::Isometry3d& X);

}  // namespace vest_instruments
