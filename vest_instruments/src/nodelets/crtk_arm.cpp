#include "crtk_arm.h"

#include <array>
#include <cmath>

#include "vest_instruments/kinematics/jacobian.h"

namespace vest_instruments {

using vest::control::Joints;
using vest::control::Source;
using vest::control::Verdict;

namespace {
const std::array<std::string, 5> kJoints{"yaw", "pitch", "insertion", "roll", "jaw"};
}

geometry_msgs::Pose toPose(const Eigen::Isometry3d& X) {
  const Eigen::Quaterniond q(X.linear());
  geometry_msgs::Pose pose;
  pose.position.x = X.translation().x();
  pose.position.y = X.translation().y();
  pose.position.z = X.translation().z();
  pose.orientation.x = q.x();
  pose.orientation.y = q.y();
  pose.orientation.z = q.z();
  pose.orientation.w = q.w();
  return pose;
}

bool fromPose(const geometry_msgs::Pose& pose, Eigen::Isometry3d& X) {
  const Eigen::Quaterniond q(pose.orientation.w, pose.orientation.x, pose.orientation.y, pose.orientation.z);
  const Eigen::Vector3d p(pose.position.x, pose.position.y, pose.position.z);
  if (!p.allFinite() || !q.coeffs().allFinite() || std::abs(q.norm() - 1.0) > 0.01) return false;
  X = Eigen::Isometry3d::Identity();
  X.linear() = q.normalized().toRotationMatrix();
  X.translation() = p;
  return true;
}

template <class M, class F>
void CrtkArm::listen(ros::NodeHandle& nh, const std::string& topic, F handler) {
  subscribers_.push_back(nh.subscribe<M>(
      topic, 10, [handler](const boost::shared_ptr<const M>& msg) { handler(*msg); }, ros::VoidConstPtr(),
      ros::TransportHints().tcpNoDelay()));
}

CrtkArm::CrtkArm(ros::NodeHandle& parent, const std::string& name, vest::control::Instrument& instrument,
                 const std::string& hand, const std::string& type_package, Clock clock)
    : name_(name), instrument_(instrument), clock_(std::move(clock)), endoscope_(name == "endoscope") {
  ros::NodeHandle nh(parent, name);
  measured_js_ = nh.advertise<sensor_msgs::JointState>("measured_js", 10);
  setpoint_js_ = nh.advertise<sensor_msgs::JointState>("setpoint_js", 10);
  measured_cp_ = nh.advertise<geometry_msgs::PoseStamped>("measured_cp", 10);
  setpoint_cp_ = nh.advertise<geometry_msgs::PoseStamped>("setpoint_cp", 10);
  measured_cv_ = nh.advertise<geometry_msgs::TwistStamped>("measured_cv", 10);
  measured_cf_ = nh.advertise<geometry_msgs::WrenchStamped>("measured_cf", 10);
  if (!endoscope_) jaw_ = nh.advertise<sensor_msgs::JointState>("jaw/measured_js", 10);

  ros::AdvertiseOptions state;
  state.init<vest_msgs::OperatingState>("operating_state", 1);
  state.datatype = type_package + "/OperatingState";
  state.latch = true;
  operating_state_ = nh.advertise(state);

  ros::SubscribeOptions command = ros::SubscribeOptions::create<vest_msgs::StringStamped>(
      "state_command", 10,
      [this](const vest_msgs::StringStampedConstPtr& msg) {
        if (!dated("state_command", msg->header)) return;
        if (!instrument_.stateCommand(msg->string, clock_())) {
          refuse("state_command", "'" + msg->string.substr(0, 60) +
                                      "' is unknown or does not fit the present state; allowed: enable, "
                                      "disable, pause, resume, home, "
                                      "unhome, source:box|haptic|crtk|teleop|replay|none");
        }
        publishStateIfChanged(ros::Time::now());
      },
      ros::VoidConstPtr(), nullptr);
  command.datatype = type_package + "/StringStamped";
  subscribers_.push_back(nh.subscribe(command));

  listen<sensor_msgs::JointState>(nh, "servo_jp", [this](const sensor_msgs::JointState& m) {
    Joints q;
    bool fifth = false;
    if (joints("servo_jp", m, q, fifth)) take("servo_jp", instrument_.servoJoints(q, fifth, clock_()));
  });
  listen<sensor_msgs::JointState>(nh, "move_jp", [this](const sensor_msgs::JointState& m) {
    Joints q;
    bool fifth = false;
    if (joints("move_jp", m, q, fifth)) take("move_jp", instrument_.moveJoints(q, fifth, clock_()));
  });
  listen<geometry_msgs::PoseStamped>(nh, "servo_cp", [this](const geometry_msgs::PoseStamped& m) {
    onPose("servo_cp", m, false, Source::Crtk);
  });
  listen<geometry_msgs::PoseStamped>(nh, "move_cp", [this](const geometry_msgs::PoseStamped& m) {
    onPose("move_cp", m, true, Source::Crtk);
  });
  if (!endoscope_) {
    listen<sensor_msgs::JointState>(nh, "jaw/servo_jp", [this](const sensor_msgs::JointState& m) {
      onJaw("jaw/servo_jp", m, Source::Crtk);
    });
  }
  listen<std_msgs::Empty>(nh, "hold",
                          [this](const std_msgs::Empty&) { take("hold", instrument_.hold(clock_())); });
  listen<std_msgs::Empty>(nh, "free",
                          [this](const std_msgs::Empty&) { take("free", instrument_.hold(clock_())); });

  ros::NodeHandle teleop(parent, hand + "/" + name);
  listen<geometry_msgs::PoseStamped>(teleop, "servo_cp", [this, hand](const geometry_msgs::PoseStamped& m) {
    onPose(hand + " servo_cp", m, false, Source::Teleop);
  });
  listen<sensor_msgs::JointState>(teleop, "jaw/servo_jp", [this, hand](const sensor_msgs::JointState& m) {
    onJaw(hand + " jaw/servo_jp", m, Source::Teleop);
  });

  for (int i = 0; i < (endoscope_ ? 5 : 4); ++i) {
    js_.name.push_back(name + "_" + (i == 4 ? "light_post" : kJoints[static_cast<std::size_t>(i)]));
  }
  js_.position.resize(js_.name.size());
  js_.velocity.resize(js_.name.size());
  jaw_js_.name = {name + "_jaw"};
  jaw_js_.position.resize(1);
  jaw_js_.velocity.resize(1);
  cp_.header.frame_id = cv_.header.frame_id = "phantom_box";
}

void CrtkArm::refuse(const std::string& topic, const std::string& reason) {
  ++refused_;
  ROS_WARN_STREAM_THROTTLE(2.0, name_ << ": " << topic << " refused: " << reason);
}

void CrtkArm::take(const std::string& topic, Verdict verdict) {
  if (verdict == Verdict::Taken || verdict == Verdict::Clutched) return;
  refuse(topic, std::string(vest::control::verdictText(verdict)) + " (source " +
                    std::string(vest::control::sourceName(instrument_.source())) + ")");
}

bool CrtkArm::dated(const std::string& topic, const std_msgs::Header& header) {
  if (!header.stamp.isZero()) return true;
  refuse(topic, "header.stamp is 0, which marks invalid data; allowed: the time of the command");
  return false;
}

bool CrtkArm::joints(const std::string& topic, const sensor_msgs::JointState& msg, Joints& q,
                     bool& has_fifth) {
  if (!dated(topic, msg.header)) return false;
  q = instrument_.setpoint();
  const std::size_t most = 5;
  if (msg.name.empty()) {
    if (msg.position.size() != 4 && msg.position.size() != most) {
      refuse(topic, "position has " + std::to_string(msg.position.size()) +
                        " values; allowed: 4 (yaw, pitch, insertion, roll) or 5");
      return false;
    }
    for (std::size_t i = 0; i < msg.position.size(); ++i) q[static_cast<Eigen::Index>(i)] = msg.position[i];
    has_fifth = msg.position.size() == most;
    return true;
  }
  if (msg.name.size() != msg.position.size()) {
    refuse(topic, "name and position differ in length");
    return false;
  }
  for (std::size_t k = 0; k < msg.name.size(); ++k) {
    std::string joint = msg.name[k];
    if (joint.rfind(name_ + "_", 0) == 0) joint.erase(0, name_.size() + 1);
    if (endoscope_ && joint == "light_post") joint = "jaw";
    std::size_t i = 0;
    while (i < kJoints.size() && kJoints[i] != joint) ++i;
    if (i == kJoints.size()) {
      refuse(topic,
             "unknown joint '" + msg.name[k].substr(0, 60) + "'; allowed: yaw, pitch, insertion, roll, jaw");
      return false;
    }
    q[static_cast<Eigen::Index>(i)] = msg.position[k];
    has_fifth = has_fifth || i == 4;
  }
  return true;
}

void CrtkArm::onPose(const std::string& topic, const geometry_msgs::PoseStamped& msg, bool move,
                     Source source) {
  if (!dated(topic, msg.header)) return;
  Eigen::Isometry3d X;
  if (!fromPose(msg.pose, X)) {
    refuse(topic, "the pose is not finite or its quaternion is no rotation");
    return;
  }
  if (!msg.header.frame_id.empty() && msg.header.frame_id != "phantom_box") {
    refuse(topic, "frame_id '" + msg.header.frame_id.substr(0, 60) + "'; allowed: phantom_box");
    return;
  }
  take(topic, move ? instrument_.movePose(X, clock_()) : instrument_.servoPose(source, X, clock_()));
}

void CrtkArm::onJaw(const std::string& topic, const sensor_msgs::JointState& msg, Source source) {
  if (!dated(topic, msg.header)) return;
  if (msg.position.size() != 1) {
    refuse(topic,
           "position has " + std::to_string(msg.position.size()) + " values; allowed: 1 (full opening, rad)");
    return;
  }
  take(topic, instrument_.servoJaw(source, msg.position[0], clock_()));
}

void CrtkArm::publish(const ros::Time& stamp) {
  const auto& arm = instrument_.arm();
  js_.header.stamp = cp_.header.stamp = cv_.header.stamp = stamp;
  const auto fill = [&](const Joints& q, bool with_velocity) {
    for (std::size_t i = 0; i < js_.position.size(); ++i) {
      js_.position[i] = q[static_cast<Eigen::Index>(i)];
      js_.velocity[i] = with_velocity ? instrument_.velocity()[static_cast<Eigen::Index>(i)] : 0.0;
    }
  };
  if (measured_js_.getNumSubscribers() > 0) {
    fill(instrument_.measured(), true);
    if (!instrument_.valid()) js_.header.stamp = ros::Time();  // CRTK: stamp 0 marks invalid data
    measured_js_.publish(boost::make_shared<const sensor_msgs::JointState>(js_));
    js_.header.stamp = stamp;
  }
  if (setpoint_js_.getNumSubscribers() > 0) {
    fill(instrument_.setpoint(), false);
    setpoint_js_.publish(js_);
  }
  if (measured_cp_.getNumSubscribers() > 0) {
    cp_.pose = toPose(instrument_.tip());
    if (!instrument_.valid()) cp_.header.stamp = ros::Time();
    measured_cp_.publish(boost::make_shared<const geometry_msgs::PoseStamped>(cp_));
    cp_.header.stamp = stamp;
  }
  if (setpoint_cp_.getNumSubscribers() > 0) {
    cp_.pose = toPose(instrument_.setpointTip());
    setpoint_cp_.publish(cp_);
  }
  if (measured_cv_.getNumSubscribers() > 0) {
    const Eigen::Matrix<double, 6, 1> twist =
        vest::kinematics::tipJacobian(arm.X_BTrocar, vest::control::fromJoints(instrument_.measured())) *
        instrument_.velocity().head<4>();
    cv_.twist.linear.x = twist[0];
    cv_.twist.linear.y = twist[1];
    cv_.twist.linear.z = twist[2];
    cv_.twist.angular.x = twist[3];
    cv_.twist.angular.y = twist[4];
    cv_.twist.angular.z = twist[5];
    if (!instrument_.valid()) cv_.header.stamp = ros::Time();
    measured_cv_.publish(cv_);
  }
  if (!endoscope_ && jaw_.getNumSubscribers() > 0) {
    jaw_js_.header.stamp = instrument_.valid() ? stamp : ros::Time();
    jaw_js_.position[0] = instrument_.measured()[4];
    jaw_js_.velocity[0] = instrument_.velocity()[4];
    jaw_.publish(jaw_js_);
  }
}

void CrtkArm::publishStateIfChanged(const ros::Time& stamp) {
  if (instrument_.stateRevision() == published_revision_) return;
  published_revision_ = instrument_.stateRevision();
  vest_msgs::OperatingState msg;
  msg.header.stamp = stamp;
  msg.state = std::string(vest::control::operatingStateName(instrument_.operatingState()));
  msg.is_homed = instrument_.homed();
  msg.is_busy = instrument_.busy();
  operating_state_.publish(msg);
}

void CrtkArm::publishForce(const geometry_msgs::WrenchStamped& force) {
  if (measured_cf_.getNumSubscribers() > 0) measured_cf_.publish(force);
}

}  // namespace vest_instruments
