#include "crtk_arm.h"

#include <array>
#include <cmath>
#include <cstdio>

#include <std_msgs/String.h>

#include "vest_instruments/kinematics/jacobian.h"
#include "vest_instruments/ros/command_stamp.h"
#include "vest_instruments/ros/frames.h"

namespace vest_instruments {

using vest::control::Joints;
using vest::control::Verdict;

namespace {

const std::array<std::string, 5> kJoints{"yaw", "pitch", "insertion", "roll", "jaw"};

std::string number(double value) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.4g", value);
  return text.data();
}

}  // namespace

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
                 const Options& options, Clock clock)
    : name_(name),
      instrument_(instrument),
      options_(options),
      clock_(std::move(clock)),
      endoscope_(name == "endoscope") {
  ros::NodeHandle nh(parent, name);
  measured_js_ = nh.advertise<sensor_msgs::JointState>("measured_js", 10);
  setpoint_js_ = nh.advertise<sensor_msgs::JointState>("setpoint_js", 10);
  measured_cp_ = nh.advertise<geometry_msgs::PoseStamped>("measured_cp", 10);
  setpoint_cp_ = nh.advertise<geometry_msgs::PoseStamped>("setpoint_cp", 10);
  measured_cv_ = nh.advertise<geometry_msgs::TwistStamped>("measured_cv", 10);
  measured_cf_ = nh.advertise<geometry_msgs::WrenchStamped>("measured_cf", 10);
  error_ = nh.advertise<std_msgs::String>("error", 100);
  warning_ = nh.advertise<std_msgs::String>("warning", 100);
  if (!endoscope_) {
    jaw_ = nh.advertise<sensor_msgs::JointState>("jaw/measured_js", 10);
    jaw_setpoint_ = nh.advertise<sensor_msgs::JointState>("jaw/setpoint_js", 10);
  }
  ros::AdvertiseOptions state;
  state.init<vest_msgs::OperatingState>("operating_state", 10);
  state.datatype = options_.type_package + "/OperatingState";
  state.latch = true;
  operating_state_ = nh.advertise(state);

  subscribe(nh);
  serve(nh);
  ros::NodeHandle hand(parent, options_.hand + "/" + name);
  subscribeHand(hand, options_.hand);

  for (int i = 0; i < (endoscope_ ? 5 : 4); ++i) {
    js_.name.push_back(name + "_" + (i == 4 ? "light_post" : kJoints[static_cast<std::size_t>(i)]));
  }
  js_.position.resize(js_.name.size());
  js_.velocity.resize(js_.name.size());
  jaw_js_.name = {name + "_jaw"};
  jaw_js_.position.resize(1);
  jaw_js_.velocity.resize(1);
  js_.header.frame_id = jaw_js_.header.frame_id = cp_.header.frame_id = cv_.header.frame_id =
      vest::ros_shell::frameId("phantom_box");
}

void CrtkArm::subscribe(ros::NodeHandle& nh) {
  ros::SubscribeOptions command = ros::SubscribeOptions::create<vest_msgs::StringStamped>(
      "state_command", 10, [this](const vest_msgs::StringStampedConstPtr& msg) { onStateCommand(*msg); },
      ros::VoidConstPtr(), nullptr);
  command.datatype = options_.type_package + "/StringStamped";
  subscribers_.push_back(nh.subscribe(command));

  struct Motion {
    const char* name;
    Way way;
    bool relative;
  };
  for (const Motion& m : {Motion{"servo_jp", Way::Servo, false}, Motion{"servo_jr", Way::Servo, true},
                          Motion{"move_jp", Way::Move, false}, Motion{"move_jr", Way::Move, true}}) {
    listen<sensor_msgs::JointState>(nh, m.name, [this, m](const sensor_msgs::JointState& msg) {
      onJoints(m.name, msg, m.way, m.relative);
    });
  }
  for (const Motion& m : {Motion{"servo_cp", Way::Servo, false}, Motion{"servo_cr", Way::Servo, true},
                          Motion{"move_cp", Way::Move, false}, Motion{"move_cr", Way::Move, true}}) {
    listen<geometry_msgs::PoseStamped>(nh, m.name, [this, m](const geometry_msgs::PoseStamped& msg) {
      onPose(m.name, msg, m.way, m.relative, Source::Crtk);
    });
  }
  if (!endoscope_) {
    listen<sensor_msgs::JointState>(nh, "jaw/servo_jp", [this](const sensor_msgs::JointState& m) {
      onJaw("jaw/servo_jp", m, Way::Servo, Source::Crtk);
    });
    listen<sensor_msgs::JointState>(nh, "jaw/move_jp", [this](const sensor_msgs::JointState& m) {
      onJaw("jaw/move_jp", m, Way::Move, Source::Crtk);
    });
  }
  listen<std_msgs::Empty>(nh, "hold",
                          [this](const std_msgs::Empty&) { take("hold", instrument_.hold(clock_())); });
  listen<std_msgs::Empty>(nh, "free",
                          [this](const std_msgs::Empty&) { take("free", instrument_.release(clock_())); });
}

void CrtkArm::subscribeHand(ros::NodeHandle& nh, const std::string& hand) {
  listen<geometry_msgs::PoseStamped>(nh, "servo_cp", [this, hand](const geometry_msgs::PoseStamped& m) {
    onPose(hand + " servo_cp", m, Way::Servo, false, Source::Teleop);
  });
  listen<sensor_msgs::JointState>(nh, "jaw/servo_jp", [this, hand](const sensor_msgs::JointState& m) {
    onJaw(hand + " jaw/servo_jp", m, Way::Servo, Source::Teleop);
  });
}

void CrtkArm::serve(ros::NodeHandle& nh) {
  const auto advertise = [&](ros::AdvertiseServiceOptions options, const std::string& type) {
    options.datatype = options_.type_package + "/" + type;
    options.req_datatype = options.datatype + "Request";
    options.res_datatype = options.datatype + "Response";
    services_.push_back(nh.advertiseService(options));
  };
  using Forward = vest_msgs::QueryForwardKinematics;
  using Inverse = vest_msgs::QueryInverseKinematics;
  using Trigger = vest_msgs::TriggerOperatingState;
  advertise(
      ros::AdvertiseServiceOptions::create<Forward>(
          "forward_kinematics", [this](Forward::Request& q, Forward::Response& r) { return onForward(q, r); },
          nullptr, nullptr),
      "QueryForwardKinematics");
  advertise(
      ros::AdvertiseServiceOptions::create<Inverse>(
          "inverse_kinematics", [this](Inverse::Request& q, Inverse::Response& r) { return onInverse(q, r); },
          nullptr, nullptr),
      "QueryInverseKinematics");
  advertise(ros::AdvertiseServiceOptions::create<Trigger>(
                "operating_state",
                [this](Trigger::Request&, Trigger::Response& r) {
                  r.operating_state = state();
                  return true;
                },
                nullptr, nullptr),
            "TriggerOperatingState");
}

void CrtkArm::refuse(const std::string& topic, const std::string& reason) {
  ++refused_;
  std_msgs::String said;
  said.data = name_ + ": " + topic + " refused: " + reason;
  if (told_lately_(topic + reason, clock_())) return;
  ROS_WARN_STREAM(said.data);
  error_.publish(said);
}

void CrtkArm::warn(const std::string& topic, const std::string& what) {
  std_msgs::String said;
  said.data = name_ + ": " + topic + " " + what;
  if (told_lately_(topic + what, clock_())) return;
  ROS_WARN_STREAM(said.data);
  warning_.publish(said);
}

void CrtkArm::take(const std::string& topic, Verdict verdict, const std::string& beyond) {
  const std::string text(vest::control::verdictText(verdict));
  switch (verdict) {
    case Verdict::Taken:
    case Verdict::Clutched:
      break;
    case Verdict::Limited:
      warn(topic, text + ": " + beyond);
      break;
    case Verdict::OutOfReach:
      refuse(topic, text + ": " + beyond);
      break;
    case Verdict::OtherSource:
      refuse(topic, text + ", " + std::string(vest::control::sourceName(instrument_.source())) +
                        "; state_command 'source:crtk' takes it over");
      break;
    default:
      refuse(topic, text);
  }
  publishStateIfChanged();
}

bool CrtkArm::dated(const std::string& topic, const std_msgs::Header& header) {
  const std::string wrong = vest::ros_shell::wrongStamp(header.stamp);
  if (wrong.empty()) return true;
  refuse(topic, wrong);
  return false;
}

bool CrtkArm::joints(const std::string& topic, const sensor_msgs::JointState& msg, Joints& q,
                     bool& has_fifth) {
  if (!dated(topic, msg.header)) return false;
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

bool CrtkArm::pose(const std::string& topic, const geometry_msgs::PoseStamped& msg, bool relative,
                   Eigen::Isometry3d& X) {
  if (!dated(topic, msg.header)) return false;
  if (!fromPose(msg.pose, X)) {
    refuse(topic, "the pose is not finite or its quaternion is no rotation");
    return false;
  }
  const std::string& frame = msg.header.frame_id;
  const std::string box = vest::ros_shell::frameId("phantom_box"), world = vest::ros_shell::frameId("world");
  if (frame == world) {
    Eigen::Isometry3d X_BW = options_.X_WB.inverse();
    if (relative) X_BW.translation().setZero();
    X = X_BW * X;
    if (relative) X.linear() *= X_BW.linear().transpose();
  } else if (!frame.empty() && frame != box) {
    refuse(topic, "frame_id '" + frame.substr(0, 60) + "'; allowed: " + box + " (or empty), " + world);
    return false;
  }
  return true;
}

bool CrtkArm::angle(const std::string& topic, const sensor_msgs::JointState& msg, double& angle) {
  if (!dated(topic, msg.header)) return false;
  if (msg.position.size() != 1) {
    refuse(topic,
           "position has " + std::to_string(msg.position.size()) + " values; allowed: 1 (full opening, rad)");
    return false;
  }
  angle = msg.position[0];
  return true;
}

std::string CrtkArm::beyondLimits(const Joints& q) const {
  const Joints lower = vest::control::toJoints(instrument_.limits().lower);
  const Joints upper = vest::control::toJoints(instrument_.limits().upper);
  std::string text;
  for (Eigen::Index i = 0; i < q.size(); ++i) {
    if (q[i] >= lower[i] && q[i] <= upper[i]) continue;
    text += (text.empty() ? "" : ", ") + kJoints[static_cast<std::size_t>(i)] + " " + number(q[i]) +
            " (allowed: " + number(lower[i]) + " to " + number(upper[i]) + ")";
  }
  return text;
}

std::string CrtkArm::shortOf(const Eigen::Isometry3d& X_BTip) const {
  const auto found = vest::kinematics::inverseKinematics(instrument_.arm().X_BTrocar, X_BTip,
                                                         vest::control::fromJoints(instrument_.setpoint()),
                                                         instrument_.limits());
  const Eigen::Vector3d reached =
      vest::kinematics::forwardKinematics(instrument_.arm().X_BTrocar, found.q).translation();
  return "the nearest place of the tip is " + number(1e3 * (reached - X_BTip.translation()).norm()) +
         " mm away";
}

void CrtkArm::onJoints(const std::string& topic, const sensor_msgs::JointState& msg, Way way, bool relative) {
  const Joints setpoint = instrument_.setpoint();
  Joints q = relative ? Joints::Zero().eval() : setpoint;
  bool fifth = false;
  if (!joints(topic, msg, q, fifth)) return;
  if (relative) q += setpoint;
  const Verdict verdict = way == Way::Move ? instrument_.moveJoints(q, fifth, clock_())
                                           : instrument_.servoJoints(q, fifth, clock_());
  take(topic, verdict, beyondLimits(q));
}

void CrtkArm::onPose(const std::string& topic, const geometry_msgs::PoseStamped& msg, Way way, bool relative,
                     Source source) {
  Eigen::Isometry3d X;
  if (!pose(topic, msg, relative, X)) return;
  if (relative) {  // along and about the axes of the frame, at the tip
    const Eigen::Isometry3d now = instrument_.setpointTip();
    X.linear() *= now.linear();
    X.translation() += now.translation();
  }
  const Verdict verdict =
      way == Way::Move ? instrument_.movePose(X, clock_()) : instrument_.servoPose(source, X, clock_());
  const bool beyond = verdict == Verdict::Limited || verdict == Verdict::OutOfReach;
  take(topic, verdict, beyond ? shortOf(X) : "");
}

void CrtkArm::onJaw(const std::string& topic, const sensor_msgs::JointState& msg, Way way, Source source) {
  double opening = 0.0;
  if (!angle(topic, msg, opening)) return;
  const Verdict verdict = way == Way::Move ? instrument_.moveJaw(opening, clock_())
                                           : instrument_.servoJaw(source, opening, clock_());
  Joints q = instrument_.setpoint();
  q[4] = opening;
  take(topic, verdict, beyondLimits(q));
}

void CrtkArm::onStateCommand(const vest_msgs::StringStamped& msg) {
  const std::string wrong = vest::ros_shell::wrongStamp(msg.header.stamp, msg.string);
  if (!wrong.empty()) {
    refuse("state_command", wrong);
  } else if (!instrument_.stateCommand(msg.string, clock_())) {
    refuse("state_command", "'" + msg.string.substr(0, 60) +
                                "' is unknown or does not fit the present state; allowed: enable, disable, "
                                "pause, resume, home, unhome, source:box|haptic|crtk|teleop|replay|none");
  }
  publishStateIfChanged();
}

bool CrtkArm::onForward(vest_msgs::QueryForwardKinematics::Request& request,
                        vest_msgs::QueryForwardKinematics::Response& response) {
  response.cp.orientation.w = 1.0;
  Joints q = instrument_.setpoint();
  if (request.jp.size() != js_.name.size()) {
    response.message = "jp has " + std::to_string(request.jp.size()) +
                       " values; allowed: " + std::to_string(js_.name.size()) +
                       ", in the order of measured_js";
    return true;
  }
  for (std::size_t i = 0; i < request.jp.size(); ++i) q[static_cast<Eigen::Index>(i)] = request.jp[i];
  if (!q.allFinite()) {
    response.message = "a value is not finite";
    return true;
  }
  response.cp =
      toPose(vest::kinematics::forwardKinematics(instrument_.arm().X_BTrocar, vest::control::fromJoints(q)));
  response.message = beyondLimits(q);
  response.result = response.message.empty();
  return true;
}

bool CrtkArm::onInverse(vest_msgs::QueryInverseKinematics::Request& request,
                        vest_msgs::QueryInverseKinematics::Response& response) {
  Joints reference = instrument_.setpoint();
  Eigen::Isometry3d X;
  if (!fromPose(request.cp, X)) {
    response.message = "the pose is not finite or its quaternion is no rotation";
    return true;
  }
  if (!request.jp.empty() && request.jp.size() != js_.name.size()) {
    response.message = "jp has " + std::to_string(request.jp.size()) + " values; allowed: none, or " +
                       std::to_string(js_.name.size()) + ", in the order of measured_js";
    return true;
  }
  for (std::size_t i = 0; i < request.jp.size(); ++i) reference[static_cast<Eigen::Index>(i)] = request.jp[i];
  if (!reference.allFinite()) {
    response.message = "a value is not finite";
    return true;
  }
  const auto found = vest::kinematics::inverseKinematics(
      instrument_.arm().X_BTrocar, X, vest::control::fromJoints(reference), instrument_.limits());
  const Joints q = vest::control::toJoints(found.q);
  response.jp.assign(q.data(), q.data() + js_.name.size());
  response.result = found.reachable;
  if (!found.reachable) response.message = "out of reach: " + shortOf(X);
  return true;
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
    if (!instrument_.known()) js_.header.stamp = ros::Time();  // CRTK: stamp 0 marks invalid data
    measured_js_.publish(boost::make_shared<const sensor_msgs::JointState>(js_));
    js_.header.stamp = stamp;
  }
  if (setpoint_js_.getNumSubscribers() > 0) {
    fill(instrument_.setpoint(), false);
    setpoint_js_.publish(js_);
  }
  if (measured_cp_.getNumSubscribers() > 0) {
    cp_.pose = toPose(instrument_.tip());
    if (!instrument_.known()) cp_.header.stamp = ros::Time();
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
    if (!instrument_.known()) cv_.header.stamp = ros::Time();
    measured_cv_.publish(cv_);
  }
  if (!endoscope_ && jaw_.getNumSubscribers() > 0) {
    jaw_js_.header.stamp = instrument_.known() ? stamp : ros::Time();
    jaw_js_.position[0] = instrument_.measured()[4];
    jaw_js_.velocity[0] = instrument_.velocity()[4];
    jaw_.publish(jaw_js_);
  }
  if (!endoscope_ && jaw_setpoint_.getNumSubscribers() > 0) {
    jaw_js_.header.stamp = stamp;
    jaw_js_.position[0] = instrument_.setpoint()[4];
    jaw_js_.velocity[0] = 0.0;
    jaw_setpoint_.publish(jaw_js_);
  }
}

vest_msgs::OperatingState CrtkArm::state() const {
  vest_msgs::OperatingState msg;
  msg.header.stamp = ros::Time::now();
  msg.state = std::string(vest::control::operatingStateName(instrument_.operatingState()));
  msg.is_homed = instrument_.homed();
  msg.is_busy = instrument_.busy();
  return msg;
}

void CrtkArm::publishStateIfChanged() {
  if (instrument_.stateRevision() == published_revision_) return;
  published_revision_ = instrument_.stateRevision();
  vest_msgs::OperatingState msg = state();
  const ros::Time next = state_stamp_ + ros::Duration(0, 1);
  if (msg.header.stamp < next && next - msg.header.stamp < ros::Duration(vest::ros_shell::kOldestCommand))
    msg.header.stamp = next;
  state_stamp_ = msg.header.stamp;
  operating_state_.publish(msg);
}

void CrtkArm::publishForce(const geometry_msgs::WrenchStamped& force) {
  if (measured_cf_.getNumSubscribers() > 0) measured_cf_.publish(force);
}

}  // namespace vest_instruments
