#pragma once

#include <array>
#include <string>

#include <geometry_msgs/TwistStamped.h>
#include <ros/ros.h>
#include <tf2_ros/buffer.h>
#include <tf2_ros/transform_listener.h>
#include <vest_msgs/InstrumentStates.h>

#include "vest_instruments/control/camera_hand.h"

namespace vest_instruments {

/// The assistant who holds the endoscope: its functions (pedals, by way of the instruments) and a third
/// person's commands become teleop/endoscope/servo_cp, with the horizon level. Does nothing while the
/// endoscope's source is another.
class CameraAssistant {
 public:
  /// @throws std::runtime_error for a wrong parameter, with one message that names it
  CameraAssistant(ros::NodeHandle nh, ros::NodeHandle private_nh);

 private:
  void onInstruments(const vest_msgs::InstrumentStates& msg);
  void onCommand(const geometry_msgs::TwistStamped& msg);
  void onTimer();
  vest::control::CameraMotion wanted(const ros::SteadyTime& now) const;

  ros::NodeHandle nh_;
  std::string follows_;
  double dead_zone_ = 0, optic_angle_ = 0;

  tf2_ros::Buffer tf_;
  tf2_ros::TransformListener listener_{tf_};
  ros::Subscriber instruments_, command_;
  ros::Publisher pose_;
  ros::SteadyTimer timer_;

  bool held_ = false;  ///< the endoscope's source is teleop, and its joints are known
  bool taken_ = false;
  vest::kinematics::JointPositions measured_, q_;
  Eigen::Isometry3d X_WTrocar_ = Eigen::Isometry3d::Identity();
  Eigen::Vector3d followed_W_ = Eigen::Vector3d::Constant(std::nan(""));
  vest::control::CameraMotion command_rate_;
  std::uint32_t functions_ = 0;  ///< of the endoscope
  ros::SteadyTime command_time_, states_time_, last_;
};

}  // namespace vest_instruments
