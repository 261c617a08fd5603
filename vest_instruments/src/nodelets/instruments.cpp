#include "instruments.h"

#include <cmath>
#include <cstdio>

#include <diagnostic_msgs/DiagnosticArray.h>

#include "vest_instruments/kinematics/jacobian.h"
#include "vest_instruments/ros/frames.h"
#include "vest_instruments/tools/tool_geometry.h"
#include "vest_instruments/tools/tool_names.h"
#include "vest_instruments/urdf/description.h"

namespace vest_instruments {

using vest::control::Instrument;
using vest::control::Joints;
using vest::control::Source;
using vest::control::Verdict;
using vest::tools::ToolKind;

namespace {

constexpr double kPeriod = 0.002;           // s: 500 Hz where no box sets the pace
constexpr double kCrtkPeriod = 0.005;       // s: 200 Hz
constexpr double kTfPeriod = 0.010;         // s: 100 Hz
constexpr double kCollisionPeriod = 0.004;  // s: 250 Hz

const std::array<const char*, 5> kJoints{"yaw", "pitch", "insertion", "roll", "jaw"};

std::string instrumentName(std::size_t i) {
  return std::string(vest::tools::instrumentName(static_cast<vest::tools::Instrument>(i)));
}

std::string jointName(std::size_t i, std::size_t k) {
  return instrumentName(i) + "_" + (k == 4 && instrumentName(i) == "endoscope" ? "light_post" : kJoints[k]);
}

int instrumentIndex(const std::string& name) {
  for (std::size_t i = 0; i < vest::tools::kInstrumentCount; ++i) {
    if (instrumentName(i) == name) return static_cast<int>(i);
  }
  return -1;
}

void setTransform(geometry_msgs::TransformStamped& t, const Eigen::Isometry3d& X) {
  const geometry_msgs::Pose p = toPose(X);
  t.transform.translation.x = p.position.x;
  t.transform.translation.y = p.position.y;
  t.transform.translation.z = p.position.z;
  t.transform.rotation = p.orientation;
}

geometry_msgs::TransformStamped link(const std::string& parent, const std::string& child,
                                     const Eigen::Isometry3d& X) {
  geometry_msgs::TransformStamped t;
  t.header.frame_id = vest::ros_shell::frameId(parent);
  t.child_frame_id = vest::ros_shell::frameId(child);
  setTransform(t, X);
  return t;
}

Eigen::Isometry3d turn(double angle, const Eigen::Vector3d& axis,
                       const Eigen::Vector3d& at = Eigen::Vector3d::Zero()) {
  Eigen::Isometry3d X = Eigen::Isometry3d::Identity();
  X.linear() = Eigen::AngleAxisd(angle, axis).toRotationMatrix();
  X.translation() = at;
  return X;
}

geometry_msgs::TransformStamped opticLink(const vest::kinematics::TrainerArm& arm) {
  return link("endoscope_light_post", "endoscope_optic", turn(-arm.optic_angle, Eigen::Vector3d::UnitX()));
}

}  // namespace

double Instruments::steadyNow() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

void Instruments::JointMap::learn(const std::vector<std::string>& new_names,
                                  const vest::control::InputMap& inputs) {
  if (new_names == names) return;
  names = new_names;
  for (std::size_t i = 0; i < kCount; ++i) {
    const auto handle = static_cast<std::size_t>(inputs.instruments[i].handle);
    for (std::size_t k = 0; k < 5; ++k) {
      index[i][k] = -1;
      for (std::size_t n = 0; n < names.size(); ++n) {
        if (names[n] == jointName(handle, k)) index[i][k] = static_cast<int>(n);
      }
    }
  }
}

Instruments::Instruments(ros::NodeHandle nh, ros::NodeHandle private_nh)
    : configuration_(readConfiguration(nh, private_nh)), nh_(nh), collision_(configuration_.box) {
  grasping_at_.fill(-1.0);
  instruments_.reserve(kCount);
  for (std::size_t i = 0; i < kCount; ++i) {
    instruments_.emplace_back(configuration_.box.arms[i], configuration_.inputs.instruments[i].source);
  }
  crtk_.resize(kCount);
  for (std::size_t i = 0; i < kCount; ++i) {
    if (!instruments_[i].present()) continue;
    const bool gamepad = configuration_.inputs.instruments[i].gamepad();
    const CrtkArm::Options options{gamepad ? "gamepad" : "teleop", configuration_.type_package,
                                   configuration_.X_WB};
    crtk_[i] =
        std::make_unique<CrtkArm>(nh_, instrumentName(i), instruments_[i], options, &Instruments::steadyNow);
    vest_msgs::InstrumentState state;
    state.name = instrumentName(i);
    states_.instruments.push_back(state);
    for (std::size_t k = 0; k < 5; ++k) joint_states_.name.push_back(jointName(i, k));
  }
  joint_states_.position.resize(joint_states_.name.size());
  joint_states_.velocity.resize(joint_states_.name.size());
  states_.header.frame_id = vest::ros_shell::frameId("world");
  prepareTransforms();
  setDescription();

  states_publisher_ = nh_.advertise<vest_msgs::InstrumentStates>("instruments", 10);
  joint_states_publisher_ = nh_.advertise<sensor_msgs::JointState>("joint_states", 10);
  diagnostics_publisher_ = nh_.advertise<diagnostic_msgs::DiagnosticArray>("/diagnostics", 10);

  const ros::TransportHints hints = ros::TransportHints().tcpNoDelay();
  subscribers_.push_back(nh_.subscribe<sensor_msgs::JointState>(
      "phantom_box/joint_states", 20,
      [this](const sensor_msgs::JointStateConstPtr& msg) { onJoints(*msg, Source::Box, box_map_); },
      ros::VoidConstPtr(), hints));
  subscribers_.push_back(nh_.subscribe<sensor_msgs::JointState>(
      "replay/joint_states", 20,
      [this](const sensor_msgs::JointStateConstPtr& msg) { onJoints(*msg, Source::Replay, replay_map_); },
      ros::VoidConstPtr(), hints));
  pedals_.reserve(configuration_.inputs.switches.size());
  for (const vest::control::SwitchSource& source : configuration_.inputs.switches) {
    const std::size_t k = pedals_.size();
    pedals_.emplace_back(source.switches);
    switches_.push_back(nh_.subscribe<sensor_msgs::Joy>(
        source.topic(), 20, [this, k](const sensor_msgs::JoyConstPtr& msg) { onSwitches(*msg, k); },
        ros::VoidConstPtr(), hints));
  }
  subscribers_.push_back(nh_.subscribe<vest_msgs::ContactModels>(
      "tissue/contacts", 5, [this](const vest_msgs::ContactModelsConstPtr& msg) { onContacts(*msg); },
      ros::VoidConstPtr(), hints));
  for (std::size_t i = 0; i < kCount; ++i) {
    if (!instruments_[i].present()) continue;
    subscribers_.push_back(nh_.subscribe<geometry_msgs::PoseStamped>(
        "haptics/" + instrumentName(i) + "/measured_cp", 20,
        [this, i](const geometry_msgs::PoseStampedConstPtr& msg) { onHapticPose(i, *msg); },
        ros::VoidConstPtr(), hints));
    subscribers_.push_back(nh_.subscribe<sensor_msgs::JointState>(
        "haptics/" + instrumentName(i) + "/jaw/measured_js", 20,
        [this, i](const sensor_msgs::JointStateConstPtr& msg) {
          if (msg->header.stamp.isZero() || msg->position.size() != 1) return;
          instruments_[i].servoJaw(Source::Haptic, msg->position[0], steadyNow());
        },
        ros::VoidConstPtr(), hints));
  }
  services_.push_back(nh_.advertiseService("select_source", &Instruments::onSelectSource, this));
  services_.push_back(nh_.advertiseService("exchange_tool", &Instruments::onExchangeTool, this));
  services_.push_back(nh_.advertiseService("exchange_optic", &Instruments::onExchangeOptic, this));
  timer_ =
      nh_.createSteadyTimer(ros::WallDuration(kPeriod), [this](const ros::SteadyTimerEvent&) { onTimer(); });
  diagnostics_timer_ = nh_.createSteadyTimer(ros::WallDuration(1.0),
                                             [this](const ros::SteadyTimerEvent&) { onDiagnostics(); });
}

void Instruments::setDescription() {
  if (!configuration_.set_robot_description) return;
  vest::urdf::ToolSet tools;
  for (std::size_t i = 0; i < kCount; ++i) tools[i] = instruments_[i].tool();
  const std::string xml = vest::urdf::makeUrdf(configuration_.box, tools);
  vest::urdf::checkUrdf(xml);
  nh_.setParam("robot_description", xml);
}

void Instruments::onJoints(const sensor_msgs::JointState& msg, Source source, JointMap& map) {
  if (msg.header.stamp.isZero() || msg.position.size() != msg.name.size()) {
    ++rejected_;
    ROS_WARN_THROTTLE(2.0, "%s/joint_states refused: stamp 0, or name and position differ in length",
                      source == Source::Box ? "phantom_box" : "replay");
    return;
  }
  map.learn(msg.name, configuration_.inputs);
  const double now = steadyNow();
  bool used = false;
  const bool has_velocity = msg.velocity.size() == msg.position.size();
  for (std::size_t i = 0; i < kCount; ++i) {
    if (!instruments_[i].present() || instruments_[i].source() != source) continue;
    const auto& index = map.index[i];
    if (index[0] < 0 || index[1] < 0 || index[2] < 0 || index[3] < 0) continue;  // not in this message
    Joints q = instruments_[i].setpoint(), qd = Joints::Zero();
    for (Eigen::Index k = 0; k < 5; ++k) {
      const int n = index[static_cast<std::size_t>(k)];
      if (n < 0) continue;
      q[k] = msg.position[static_cast<std::size_t>(n)];
      if (has_velocity) qd[k] = msg.velocity[static_cast<std::size_t>(n)];
    }
    const Verdict verdict =
        instruments_[i].sensedJoints(source, q, index[4] >= 0, has_velocity ? &qd : nullptr, now);
    if (verdict == Verdict::NotFinite) {
      ++rejected_;
      ROS_WARN_THROTTLE(2.0, "%s: a joint of the %s is not finite: pose held", instrumentName(i).c_str(),
                        source == Source::Box ? "box" : "replay");
    }
    used = true;
  }
  if (!used) return;
  if (source == Source::Box) {
    last_box_ = now;
    box_ahead_ = (msg.header.stamp - ros::Time::now()).toSec();
  }
  // One pace: where box and replay both move instruments, the box's messages set it.
  if (source == Source::Box || now - last_box_ > 0.01) publish(msg.header.stamp, now);
}

bool Instruments::twoPress(std::size_t k) const {
  // A keyboard's switches count only while its window teleoperates; two windows may be open.
  return k < switches_.size() && configuration_.inputs.switches[k].on != "teleop" &&
         switches_[k].getNumPublishers() > 1;
}

void Instruments::onSwitches(const sensor_msgs::Joy& msg, std::size_t k) {
  if (msg.header.stamp.isZero()) return;
  if (twoPress(k)) {  // nobody knows whose foot it is: what is not heard is released
    pedals_[k].forget();
    ROS_ERROR_THROTTLE(10.0, "%s: two publishers, none of them is heard: all its switches count as released",
                       switches_[k].getTopic().c_str());
    return;
  }
  if (renamed_ && configuration_.inputs.switches[k].on == "box") {
    pedals_[k].forget();
    return;
  }
  vest::control::Pedals& pedals = pedals_[k];
  std::uint32_t mask = 0;
  for (std::size_t i = 0; i < msg.buttons.size() && i < vest::control::Pedals::kMost; ++i) {
    if (msg.buttons[i] == 1) mask |= 1u << i;
  }
  pedals.update(mask, steadyNow());
  const vest::control::InstrumentMask pressed = pedals.takeToolPress();
  for (std::size_t i = 0; i < kCount; ++i) {
    if ((pressed >> i & 1u) != 0 && instruments_[i].present()) nextTool(i);
  }
}

void Instruments::nextTool(std::size_t i) {
  const auto& tray = configuration_.tool_tray;
  const int current = static_cast<int>(instruments_[i].tool());
  int following = current + 1 < vest::tools::kToolKindCount ? current + 1 : 1;
  if (static_cast<ToolKind>(following) == ToolKind::Endoscope) ++following;
  const ToolKind next = tray.empty() ? static_cast<ToolKind>(following) : tray[tray_place_[i] % tray.size()];
  const std::string reason = exchange(i, next);
  if (reason.empty())
    ++tray_place_[i];
  else
    ROS_WARN("%s: %s", instrumentName(i).c_str(), reason.c_str());
}

std::uint32_t Instruments::functions(std::size_t i, double now) const {
  const auto of = vest::control::maskOf(static_cast<vest::tools::Instrument>(i));
  std::uint32_t on = 0;
  for (const vest::control::Pedals& pedals : pedals_) on |= pedals.active(instruments_[i].tool(), now, of);
  return on;
}

void Instruments::onContacts(const vest_msgs::ContactModels& msg) {
  const double now = steadyNow();
  geometry_msgs::WrenchStamped force;
  force.header.stamp = msg.header.stamp;
  force.header.frame_id = vest::ros_shell::frameId("phantom_box");
  const Eigen::Matrix3d R_BW = configuration_.X_WB.linear().transpose();
  for (const auto& contact : msg.contacts) {
    const int i = instrumentIndex(contact.instrument);
    if (i < 0 || !crtk_[static_cast<std::size_t>(i)]) continue;
    grasping_[static_cast<std::size_t>(i)] = contact.grasping;
    grasping_at_[static_cast<std::size_t>(i)] = now;
    const auto turned = [&](const geometry_msgs::Vector3& v) {
      const Eigen::Vector3d w = R_BW * Eigen::Vector3d(v.x, v.y, v.z);
      geometry_msgs::Vector3 out;
      out.x = w.x();
      out.y = w.y();
      out.z = w.z();
      return out;
    };
    force.wrench.force = turned(contact.wrench.force);
    force.wrench.torque = turned(contact.wrench.torque);
    crtk_[static_cast<std::size_t>(i)]->publishForce(force);
    const geometry_msgs::Vector3 &f = force.wrench.force, &t = force.wrench.torque;
    instruments_[static_cast<std::size_t>(i)].feel(
        (Eigen::Matrix<double, 6, 1>() << f.x, f.y, f.z, t.x, t.y, t.z).finished(), now);
  }
}

void Instruments::onHapticPose(std::size_t i, const geometry_msgs::PoseStamped& msg) {
  if (instruments_[i].source() != Source::Haptic || msg.header.stamp.isZero()) return;
  Eigen::Isometry3d X;
  if (!fromPose(msg.pose, X)) {
    ++rejected_;
    return;
  }
  instruments_[i].servoPose(Source::Haptic, X, steadyNow());
}

void Instruments::onTimer() {
  const double now = steadyNow();
  if (last_publish_ < 0.0 || now - last_publish_ > 0.75 * kPeriod) {
    // Where a box runs, it sets the pace: step in only once it is late.
    if (last_box_ >= 0.0 && now - last_box_ < 5.0 * kPeriod) return;
    publish(ros::Time::now(), now);
  }
}

void Instruments::publish(const ros::Time& stamp, double now) {
  if (stamp == last_stamp_) return;  // a simulated clock that stands still
  last_stamp_ = stamp;
  last_publish_ = now;
  ++published_;
  for (std::size_t i = 0; i < kCount; ++i) {
    Instrument& instrument = instruments_[i];
    if (!instrument.present()) continue;
    instrument.setClutch((functions(i, now) & vest::tools::kFunctionClutch) != 0);
    instrument.update(now);
  }
  if (last_collision_ < 0.0 || now - last_collision_ >= kCollisionPeriod) {
    last_collision_ = now;
    checkCollisions();
  }
  fillStates(stamp, now);
  // Nodelets of this process get the message itself, unserialised: one of its own each time.
  states_publisher_.publish(boost::make_shared<const vest_msgs::InstrumentStates>(states_));
  if (joint_states_publisher_.getNumSubscribers() > 0)
    joint_states_publisher_.publish(boost::make_shared<const sensor_msgs::JointState>(joint_states_));
  if (last_tf_ < 0.0 || now - last_tf_ >= kTfPeriod - 0.0005) {
    last_tf_ = now;
    publishTransforms(stamp);
  }
  if (last_crtk_ < 0.0 || now - last_crtk_ >= kCrtkPeriod - 0.0005) {
    last_crtk_ = now;
    for (auto& arm : crtk_) {
      if (arm) arm->publish(stamp);
    }
  }
  for (auto& arm : crtk_) {
    if (arm) arm->publishStateIfChanged();
  }
}

void Instruments::fillStates(const ros::Time& stamp, double now) {
  states_.header.stamp = joint_states_.header.stamp = stamp;
  ++states_.sequence;
  std::size_t n = 0;
  for (std::size_t i = 0; i < kCount; ++i) {
    const Instrument& instrument = instruments_[i];
    if (!instrument.present()) continue;
    auto& s = states_.instruments[n];
    s.tool = static_cast<std::uint8_t>(instrument.tool());
    s.source = static_cast<std::uint8_t>(instrument.source());
    s.valid = instrument.valid();
    const Joints& q = instrument.measured();
    const Joints& qd = instrument.velocity();
    for (std::size_t k = 0; k < 5; ++k) {
      s.joint_position[k] = q[static_cast<Eigen::Index>(k)];
      s.joint_velocity[k] = qd[static_cast<Eigen::Index>(k)];
      joint_states_.position[5 * n + k] = s.joint_position[k];
      joint_states_.velocity[5 * n + k] = s.joint_velocity[k];
    }
    const Eigen::Isometry3d X_WTip = configuration_.X_WB * instrument.tip();
    Eigen::Isometry3d X_WShaft = X_WTip;
    X_WShaft.translation() = configuration_.X_WB * instrument.arm().pivot_B;
    s.tip = toPose(X_WTip);
    s.shaft = toPose(X_WShaft);
    const Eigen::Matrix<double, 6, 1> twist =
        vest::kinematics::tipJacobian(configuration_.X_WB * instrument.arm().X_BTrocar,
                                      vest::control::fromJoints(q)) *
        qd.head<4>();
    s.twist.linear.x = twist[0];
    s.twist.linear.y = twist[1];
    s.twist.linear.z = twist[2];
    s.twist.angular.x = twist[3];
    s.twist.angular.y = twist[4];
    s.twist.angular.z = twist[5];
    s.functions = instrument.valid() ? functions(i, now) : 0u;
    if (instrument.fires()) s.functions |= vest::tools::kFunctionFire;
    if (instrument.tool() == ToolKind::Endoscope) {
      const Eigen::Vector3d sight =
          vest::kinematics::opticalFrame(instrument.arm().optic_angle, q[4]).linear().col(2);
      for (std::size_t k = 0; k < 3; ++k) s.sight[k] = sight[static_cast<Eigen::Index>(k)];
    }
    s.colliding = colliding_[i];
    ++n;
  }
}

void Instruments::checkCollisions() {
  std::array<vest::collision::ArmPose, kCount> poses;
  for (std::size_t i = 0; i < kCount; ++i) {
    const Instrument& instrument = instruments_[i];
    if (!instrument.present()) continue;
    poses[i] = {true, instrument.tool(), instrument.tip(), instrument.measured()[2],
                instrument.measured()[4]};
  }
  colliding_ = collision_.check(poses);
}

// Order within an instrument: yaw, pitch, insertion, roll, then jaw, jaw_left, jaw_right, or light_post,
// camera head.
void Instruments::prepareTransforms() {
  std::vector<geometry_msgs::TransformStamped> fixed;
  const Eigen::Isometry3d I = Eigen::Isometry3d::Identity();
  fixed.push_back(link("world", "phantom_box", configuration_.X_WB));
  for (std::size_t i = 0; i < kCount; ++i) {
    if (!instruments_[i].present()) continue;
    const std::string n = instrumentName(i);
    const auto& arm = instruments_[i].arm();
    fixed.push_back(link("phantom_box", n + "_trocar", arm.X_BTrocar));
    fixed.push_back(link(n + "_roll", n + "_tip", I));
    transforms_.push_back(link(n + "_trocar", n + "_yaw", I));
    transforms_.push_back(link(n + "_yaw", n + "_pitch", I));
    transforms_.push_back(link(n + "_pitch", n + "_insertion", I));
    transforms_.push_back(link(n + "_insertion", n + "_roll", I));
    if (n == "endoscope") {
      fixed.push_back(opticLink(arm));
      transforms_.push_back(link("endoscope_tip", "endoscope_light_post", I));
      transforms_.push_back(link("endoscope_optic", "endoscope_optical_frame", I));
    } else {
      transforms_.push_back(link(n + "_tip", n + "_jaw", I));
      transforms_.push_back(link(n + "_tip", n + "_jaw_left", I));
      transforms_.push_back(link(n + "_tip", n + "_jaw_right", I));
    }
  }
  for (auto& t : fixed) t.header.stamp = ros::Time::now();
  static_tf_.sendTransform(fixed);
}

void Instruments::publishTransforms(const ros::Time& stamp) {
  using Eigen::Vector3d;
  for (auto& t : transforms_) t.header.stamp = stamp;
  std::size_t n = 0;
  for (std::size_t i = 0; i < kCount; ++i) {
    const Instrument& instrument = instruments_[i];
    if (!instrument.present()) continue;
    const Joints& q = instrument.measured();
    setTransform(transforms_[n++], turn(q[0], Vector3d::UnitY()));
    setTransform(transforms_[n++], turn(q[1], Vector3d::UnitX()));
    setTransform(transforms_[n++], turn(0.0, Vector3d::UnitX(), {0, 0, q[2]}));
    setTransform(transforms_[n++], turn(q[3], Vector3d::UnitZ()));
    if (instrument.tool() == ToolKind::Endoscope) {
      setTransform(transforms_[n++], turn(q[4], Vector3d::UnitZ()));
      setTransform(transforms_[n++], turn(-q[4], Vector3d::UnitZ()));
    } else {
      const Vector3d axis(0, 0, -vest::tools::toolGeometry(instrument.tool()).jaw_length);
      setTransform(transforms_[n++], turn(q[4], Vector3d::UnitY()));
      setTransform(transforms_[n++], turn(0.5 * q[4], Vector3d::UnitY(), axis));
      setTransform(transforms_[n++], turn(-0.5 * q[4], Vector3d::UnitY(), axis));
    }
  }
  tf_.sendTransform(transforms_);
}

std::string Instruments::exchange(std::size_t i, ToolKind tool) {
  if (tool == instruments_[i].tool()) return {};  // also while it holds tissue: nothing changes
  if (grasping_[i] && steadyNow() - grasping_at_[i] < 0.5)
    return "it holds tissue: release it before the tool is exchanged";
  if (!instruments_[i].exchangeTool(tool))
    return "this tool does not fit; allowed: " + vest::tools::handTools(true);
  setDescription();
  return {};
}

bool Instruments::onExchangeTool(vest_msgs::ExchangeTool::Request& request,
                                 vest_msgs::ExchangeTool::Response& response) {
  const int i = instrumentIndex(request.instrument);
  if (i < 0 || i == static_cast<int>(vest::tools::Instrument::Endoscope) ||
      !instruments_[static_cast<std::size_t>(i)].present()) {
    response.message = "instrument '" + request.instrument + "' holds no tool; allowed: left, right, third";
  } else if (request.tool >= vest::tools::kToolKindCount) {
    response.message =
        "tool " + std::to_string(request.tool) + " is unknown; allowed: " + vest::tools::handTools(true);
  } else {
    response.message = exchange(static_cast<std::size_t>(i), static_cast<ToolKind>(request.tool));
  }
  response.success = response.message.empty();
  return true;
}

bool Instruments::onExchangeOptic(vest_msgs::ExchangeOptic::Request& request,
                                  vest_msgs::ExchangeOptic::Response& response) {
  Instrument& endoscope = instruments_[static_cast<std::size_t>(vest::tools::Instrument::Endoscope)];
  if (!endoscope.present()) {
    response.message = "there is no endoscope in this box";
  } else if (!endoscope.exchangeOptic(request.angle)) {
    char text[96];
    std::snprintf(text, sizeof text, "angle %g: there is no such optic; allowed: 0 to %g rad", request.angle,
                  Instrument::kOpticMost);
    response.message = text;
  } else {
    configuration_.box.arms[static_cast<std::size_t>(vest::tools::Instrument::Endoscope)].optic_angle =
        request.angle;
    auto optic = opticLink(endoscope.arm());
    optic.header.stamp = ros::Time::now();
    static_tf_.sendTransform(optic);
    setDescription();
  }
  response.success = response.message.empty();
  return true;
}

bool Instruments::onSelectSource(vest_msgs::SelectSource::Request& request,
                                 vest_msgs::SelectSource::Response& response) {
  const int i = instrumentIndex(request.instrument);
  const auto source = vest::control::sourceFromValue(request.source);
  if (i < 0 || !instruments_[static_cast<std::size_t>(i)].present()) {
    response.message =
        "instrument '" + request.instrument + "' is unknown; allowed: left, right, third, endoscope";
  } else if (!source) {
    response.message = "source " + std::to_string(request.source) + " is unknown; allowed: 0 … 5";
  } else {
    instruments_[static_cast<std::size_t>(i)].selectSource(*source, steadyNow());
  }
  response.success = response.message.empty();
  return true;
}

}  // namespace vest_instruments
