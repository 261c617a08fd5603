#include "teleop_sender.h"

#include "vest_instruments/ros/frames.h"

namespace vest::displays {

TeleopSender::TeleopSender(const ros::NodeHandle& handle) : handle_(handle), spinner_(1, &queue_) {
  handle_.setCallbackQueue(&queue_);
  pose_.header.frame_id = ros_shell::frameId("phantom_box");
  jaw_.position.resize(1);
  joy_.buttons.resize(kSwitches);
  switches_publisher_ = handle_.advertise<sensor_msgs::Joy>("teleop/footswitches", 10);
  timer_ =
      handle_.createSteadyTimer(ros::WallDuration(0.02), [this](const ros::SteadyTimerEvent&) { send(); });
  spinner_.start();
}

TeleopSender::~TeleopSender() {
  timer_.stop();
  spinner_.stop();
}

void TeleopSender::choose(const std::string& instrument) {
  const std::lock_guard<std::mutex> lock(mutex_);
  set_ = ros::SteadyTime();
  pose_publisher_ = handle_.advertise<geometry_msgs::PoseStamped>("teleop/" + instrument + "/servo_cp", 5);
  jaw_publisher_ = handle_.advertise<sensor_msgs::JointState>("teleop/" + instrument + "/jaw/servo_jp", 5);
}

void TeleopSender::set(bool moves, const Eigen::Isometry3d& X_BTip, double jaw, std::uint32_t switches) {
  const std::lock_guard<std::mutex> lock(mutex_);
  const Eigen::Quaterniond q(X_BTip.linear());
  pose_.pose.position.x = X_BTip.translation().x();
  pose_.pose.position.y = X_BTip.translation().y();
  pose_.pose.position.z = X_BTip.translation().z();
  pose_.pose.orientation.x = q.x();
  pose_.pose.orientation.y = q.y();
  pose_.pose.orientation.z = q.z();
  pose_.pose.orientation.w = q.w();
  jaw_.position[0] = jaw;
  for (int i = 0; i < kSwitches; ++i)
    joy_.buttons[static_cast<std::size_t>(i)] = static_cast<int>(switches >> i & 1u);
  moves_ = moves;
  set_ = ros::SteadyTime::now();
}

void TeleopSender::send() {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (set_.isZero() || (ros::SteadyTime::now() - set_).toSec() > kPatience) return;
  pose_.header.stamp = jaw_.header.stamp = joy_.header.stamp = ros::Time::now();
  if (moves_) {
    pose_publisher_.publish(pose_);
    jaw_publisher_.publish(jaw_);
  }
  switches_publisher_.publish(joy_);
}

}  // namespace vest::displays
