#pragma once

#include <functional>
#include <string>
#include <vector>

#include <geometry_msgs/PoseStamped.h>
#include <geometry_msgs/TwistStamped.h>
#include <geometry_msgs/WrenchStamped.h>
#include <ros/ros.h>
#include <sensor_msgs/JointState.h>
#include <std_msgs/Empty.h>
#include <vest_msgs/OperatingState.h>
#include <vest_msgs/QueryForwardKinematics.h>
#include <vest_msgs/QueryInverseKinematics.h>
#include <vest_msgs/StringStamped.h>
#include <vest_msgs/TriggerOperatingState.h>

#include "vest_instruments/control/instrument.h"
#include "vest_instruments/ros/told_lately.h"

namespace vest_instruments {

/// CRTK topics and services of one instrument: converts and publishes, decides nothing. What it refuses or
/// takes only in part it says at once, on the topics `error` and `warning` and in the log; the same sentence
/// about the same command again only after 2 s.
class CrtkArm {
 public:
  using Clock = std::function<double()>;  ///< steady time, s

  struct Options {
    std::string hand;  ///< namespace of the source `teleop`: teleop, or gamepad where the input map says so
    std::string type_package;  ///< named in wire types of crtk_msgs (same MD5 either way)
    Eigen::Isometry3d X_WB = Eigen::Isometry3d::Identity();  ///< phantom_box in world
  };
  CrtkArm(ros::NodeHandle& nh, const std::string& name, vest::control::Instrument& instrument,
          const Options& options, Clock clock);

  /// measured_*, setpoint_*: only what somebody listens to.
  void publish(const ros::Time& stamp);
  /// Latched, at every change. Its stamps grow strictly: a client compares them with the moment of its
  /// command.
  void publishStateIfChanged();
  /// Force of the tissue on the instrument, in phantom_box.
  void publishForce(const geometry_msgs::WrenchStamped& force);
  std::uint64_t refused() const { return refused_; }
  const std::string& name() const { return name_; }

 private:
  using Source = vest::control::Source;
  enum class Way { Servo, Move };

  template <class M, class F>
  void listen(ros::NodeHandle& nh, const std::string& topic, F handler);
  void subscribe(ros::NodeHandle& nh);
  void subscribeHand(ros::NodeHandle& nh, const std::string& hand);
  void serve(ros::NodeHandle& nh);
  void refuse(const std::string& topic, const std::string& reason);
  void warn(const std::string& topic, const std::string& what);
  /// Tells what became of a command, and at once what it changed. @param beyond what is out of reach
  void take(const std::string& topic, vest::control::Verdict verdict, const std::string& beyond = {});
  bool dated(const std::string& topic, const std_msgs::Header& header);
  /// Joint values from names or, without names, by order; the rest keeps `q`.
  bool joints(const std::string& topic, const sensor_msgs::JointState& msg, vest::control::Joints& q,
              bool& has_fifth);
  /// Pose or displacement in phantom_box. @param relative a displacement: axes of the frame, place of the tip
  bool pose(const std::string& topic, const geometry_msgs::PoseStamped& msg, bool relative,
            Eigen::Isometry3d& X);
  bool angle(const std::string& topic, const sensor_msgs::JointState& msg, double& angle);
  std::string beyondLimits(const vest::control::Joints& q) const;
  std::string shortOf(const Eigen::Isometry3d& X_BTip) const;

  void onJoints(const std::string& topic, const sensor_msgs::JointState& msg, Way way, bool relative);
  void onPose(const std::string& topic, const geometry_msgs::PoseStamped& msg, Way way, bool relative,
              Source source);
  void onJaw(const std::string& topic, const sensor_msgs::JointState& msg, Way way, Source source);
  void onStateCommand(const vest_msgs::StringStamped& msg);
  bool onForward(vest_msgs::QueryForwardKinematics::Request& request,
                 vest_msgs::QueryForwardKinematics::Response& response);
  bool onInverse(vest_msgs::QueryInverseKinematics::Request& request,
                 vest_msgs::QueryInverseKinematics::Response& response);
  vest_msgs::OperatingState state() const;

  std::string name_;
  vest::control::Instrument& instrument_;
  Options options_;
  Clock clock_;
  ros::Publisher measured_js_, setpoint_js_, measured_cp_, setpoint_cp_, measured_cv_, measured_cf_, jaw_,
      jaw_setpoint_, operating_state_, error_, warning_;
  std::vector<ros::Subscriber> subscribers_;
  std::vector<ros::ServiceServer> services_;
  sensor_msgs::JointState js_, jaw_js_;
  geometry_msgs::PoseStamped cp_;
  geometry_msgs::TwistStamped cv_;
  std::uint32_t published_revision_ = ~0u;
  ros::Time state_stamp_;
  std::uint64_t refused_ = 0;
  vest::ros_shell::ToldLately told_lately_;
  bool endoscope_;
};

/// Isometry to message.
geometry_msgs::Pose toPose(const Eigen::Isometry3d& X);
/// Message to isometry; false where not finite or the quaternion is no rotation (norm off 1 by more than 1
/// %).
bool fromPose(const geometry_msgs::Pose& pose, Eigen::Isometry3d& X);

}  // namespace vest_instruments
