#include "camera_assistant.h"

#include <algorithm>
#include <cmath>

#include <geometry_msgs/PoseStamped.h>

#include "configuration.h"
#include "crtk_arm.h"
#include "vest_instruments/control/pedals.h"
#include "vest_instruments/kinematics/jacobian.h"
#include "vest_instruments/ros/frames.h"

namespace vest_instruments {

using vest::control::CameraMotion;
namespace kin = vest::kinematics;

namespace {

constexpr double kPeriod = 0.01;  // s
constexpr double kApart = 0.02;   // m, rad: the instrument node went elsewhere, e.g. to a limit

bool fresh(const ros::SteadyTime& then, const ros::SteadyTime& now) {
  return !then.isZero() && (now - then).toSec() < vest::control::Pedals::kStale;
}

}  // namespace

CameraAssistant::CameraAssistant(ros::NodeHandle nh, ros::NodeHandle private_nh) : nh_(nh) {
  follows_ = read<std::string>(private_nh, "follow", "right", "a word");
  if (follows_ != "left" && follows_ != "right" && follows_ != "third")
    refuse(private_nh, "follow", "'" + follows_ + "'", "left, right, third");
  if (private_nh.hasParam("switches"))
    refuse(private_nh, "switches", "is no more",
           "footswitch_preset dvrk or custom, or an input map, with camera_follow, camera_in, camera_out");
  dead_zone_ = read<double>(private_nh, "dead_zone", 0.12, "a number");
  if (!(dead_zone_ >= 0.0 && dead_zone_ <= 1.0))
    refuse(private_nh, "dead_zone", std::to_string(dead_zone_), "0 … 1 rad");

  pose_ = nh_.advertise<geometry_msgs::PoseStamped>("teleop/endoscope/servo_cp", 10);
  const auto hints = ros::TransportHints().tcpNoDelay();
  instruments_ = nh_.subscribe<vest_msgs::InstrumentStates>(
      "instruments", 1, [this](const vest_msgs::InstrumentStatesConstPtr& m) { onInstruments(*m); }, nullptr,
      hints);
  command_ = nh_.subscribe<geometry_msgs::TwistStamped>(
      "camera_hand/servo_cv", 10, [this](const geometry_msgs::TwistStampedConstPtr& m) { onCommand(*m); },
      nullptr, hints);
  timer_ =
      nh_.createSteadyTimer(ros::WallDuration(kPeriod), [this](const ros::SteadyTimerEvent&) { onTimer(); });
}

void CameraAssistant::onInstruments(const vest_msgs::InstrumentStates& msg) {
  held_ = false;
  functions_ = 0;
  for (const vest_msgs::InstrumentState& s : msg.instruments) {
    Eigen::Isometry3d X_WTip, X_WShaft;
    if (!fromPose(s.tip, X_WTip) || !fromPose(s.shaft, X_WShaft)) continue;
    if (s.name == follows_) followed_W_ = X_WTip.translation();
    if (s.name != "endoscope" || s.source != vest_msgs::InstrumentState::SOURCE_TELEOP) continue;
    held_ = true;
    functions_ = s.functions;
    optic_angle_ = std::atan2(std::hypot(s.sight[0], s.sight[1]), s.sight[2]);
    const auto& j = s.joint_position;
    measured_ = {j[0], j[1], j[2], j[3], j[4]};
    // What lies between trocar and tip is known: the rest is the trocar, wherever the box stands.
    X_WTrocar_.linear() =
        X_WTip.linear() *
        kin::forwardKinematics(Eigen::Isometry3d::Identity(), measured_).linear().transpose();
    X_WTrocar_.translation() = X_WShaft.translation();
  }
  states_time_ = ros::SteadyTime::now();
}

void CameraAssistant::onCommand(const geometry_msgs::TwistStamped& msg) {
  // Turning about the picture's down goes to the right, about its right goes up.
  const CameraMotion rate{msg.twist.angular.y, -msg.twist.angular.x, msg.twist.linear.z};
  if (!std::isfinite(rate.right) || !std::isfinite(rate.down) || !std::isfinite(rate.in)) {
    ROS_WARN_THROTTLE(2.0, "camera_hand/servo_cv refused: a value is not finite");
    return;
  }
  using namespace vest::control;
  command_rate_.right = std::clamp(rate.right, -kCameraSpeed, kCameraSpeed);
  command_rate_.down = std::clamp(rate.down, -kCameraSpeed, kCameraSpeed);
  command_rate_.in = std::clamp(rate.in, -kCameraSpeedInsertion, kCameraSpeedInsertion);
  command_time_ = ros::SteadyTime::now();
}

CameraMotion CameraAssistant::wanted(const ros::SteadyTime& now) const {
  CameraMotion motion;
  if (fresh(command_time_, now)) {
    motion = command_rate_;
    motion.right *= kPeriod, motion.down *= kPeriod, motion.in *= kPeriod;
  }
  const auto on = [this](std::uint32_t function) { return (functions_ & function) != 0; };
  const double step = vest::control::kCameraSpeedInsertion * kPeriod;
  motion.in +=
      (on(vest::tools::kFunctionCameraIn) ? step : 0.0) - (on(vest::tools::kFunctionCameraOut) ? step : 0.0);
  if (on(vest::tools::kFunctionCameraFollow)) {
    Eigen::Isometry3d X_WOptical = kin::forwardKinematics(X_WTrocar_, q_);
    X_WOptical.linear() *= kin::opticalFrame(optic_angle_, q_.jaw).linear();
    const CameraMotion towards =
        vest::control::follow(X_WOptical.inverse() * followed_W_, dead_zone_, kPeriod);
    motion.right += towards.right;
    motion.down += towards.down;
  }
  return motion;
}

void CameraAssistant::onTimer() {
  const ros::SteadyTime now = ros::SteadyTime::now();
  if (!held_ || !fresh(states_time_, now)) {
    taken_ = false;
    return;
  }
  const std::string box = vest::ros_shell::frameId("phantom_box");
  Eigen::Isometry3d X_BW;
  try {
    const auto t = tf_.lookupTransform(box, vest::ros_shell::frameId("world"), ros::Time()).transform;
    geometry_msgs::Pose pose;
    pose.position.x = t.translation.x, pose.position.y = t.translation.y, pose.position.z = t.translation.z;
    pose.orientation = t.rotation;
    if (!fromPose(pose, X_BW)) return;
  } catch (const tf2::TransformException&) {
    return;  // the instrument node has not spoken yet
  }
  const auto apart = [&] {
    return std::max({std::abs(q_.yaw - measured_.yaw), std::abs(q_.pitch - measured_.pitch),
                     std::abs(q_.insertion - measured_.insertion)}) > kApart;
  };
  CameraMotion motion;
  if (!taken_ || apart())
    q_ = measured_;  // takes the endoscope over where it is
  else
    motion = wanted(now);
  taken_ = true;
  q_.jaw = measured_.jaw;
  q_ =
      vest::control::moveCamera(X_WTrocar_, q_, motion, {}, kin::opticalFrame(optic_angle_, q_.jaw).linear());
  geometry_msgs::PoseStamped out;
  out.header.stamp = ros::Time::now();
  out.header.frame_id = box;
  out.pose = toPose(X_BW * kin::forwardKinematics(X_WTrocar_, q_));
  pose_.publish(out);
}

}  // namespace vest_instruments
