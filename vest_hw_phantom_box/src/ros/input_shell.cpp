#include "input_shell.h"

#include <algorithm>
#include <chrono>

#include <diagnostic_msgs/DiagnosticArray.h>
#include <ros/package.h>

#include "vest_instruments/ros/frames.h"

namespace vest::ros_shell {
namespace {

constexpr double kPeriod = 0.005;     // s: devices are looked at 200 times a second
constexpr double kHeartbeat = 0.010;  // s: older than 100 ms counts as released
constexpr double kRetry = 1.0;        // s between two attempts to open

std::string text(const ros::NodeHandle& nh, const char* name, const std::string& otherwise) {
  std::string value;
  if (!nh.hasParam(name)) return otherwise;
  if (!nh.getParam(name, value))
    throw std::runtime_error("parameter " + nh.resolveName(name) + ": has a wrong type; allowed: a path");
  return value;
}

}  // namespace

double InputShell::steadyNow() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

InputShell::InputShell(ros::NodeHandle nh, ros::NodeHandle private_nh) {
  const std::string file = text(private_nh, "inputs", "");
  if (file.empty())
    throw std::runtime_error("parameter " + private_nh.resolveName("inputs") +
                             ": missing; allowed: path of an input map (YAML)");
  map_ = control::loadInputMap(file);
  const kinematics::TrainerBox box = kinematics::loadTrainerBox(text(
      private_nh, "trainer_box", ros::package::getPath("vest_instruments") + "/config/trainer_box.yaml"));
  for (const control::EventDevice& wanted : map_.devices) {
    for (const std::string& name : wanted.buttons) {
      if (!events::keyCode(name))
        throw std::runtime_error(file + ": devices." + wanted.name + ".buttons: '" + name +
                                 "'; allowed: names of linux/input-event-codes.h, e.g. BTN_SOUTH");
    }
    for (const std::string& name : wanted.axes) {
      if (!events::axisCode(name))
        throw std::runtime_error(file + ": devices." + wanted.name + ".axes: '" + name +
                                 "'; allowed: names of linux/input-event-codes.h, e.g. ABS_X");
    }
    Device d;
    d.wanted = &wanted;
    d.joy = nh.advertise<sensor_msgs::Joy>("input/" + wanted.name, 20);
    devices_.push_back(std::move(d));
  }
  for (int i = 0; i < tools::kInstrumentCount; ++i) {
    const control::InstrumentInput& in = map_.instruments[static_cast<std::size_t>(i)];
    const auto instrument = static_cast<tools::Instrument>(i);
    if (!in.gamepad() || !box.arm(instrument).present) continue;
    const std::string name(tools::instrumentName(instrument));
    std::size_t device = 0;
    while (devices_[device].wanted->name != in.device) ++device;
    hands_.push_back({control::Teleoperator(box.arm(instrument)), &in.pad, device, name,
                      nh.advertise<geometry_msgs::PoseStamped>("gamepad/" + name + "/servo_cp", 5),
                      nh.advertise<sensor_msgs::JointState>("gamepad/" + name + "/jaw/servo_jp", 5)});
  }
  diagnostics_ = nh.advertise<diagnostic_msgs::DiagnosticArray>("/diagnostics", 10);
  instruments_ = nh.subscribe<vest_msgs::InstrumentStates>(
      "instruments", 1, [this](const vest_msgs::InstrumentStatesConstPtr& msg) { onInstruments(*msg); });
  timer_ =
      nh.createSteadyTimer(ros::WallDuration(kPeriod), [this](const ros::SteadyTimerEvent&) { onTimer(); });
  second_ =
      nh.createSteadyTimer(ros::WallDuration(1.0), [this](const ros::SteadyTimerEvent&) { onDiagnostics(); });
}

void InputShell::open(Device& d, double now) {
  if (now < d.next_try) return;
  d.next_try = now + kRetry;
  try {
    d.device = std::make_unique<events::InputDevice>(*d.wanted, events::openSource(*d.wanted));
    d.problem.clear();
    ROS_INFO("input/%s: %s", d.wanted->name.c_str(), d.device->name().c_str());
  } catch (const events::DeviceError& e) {
    if (d.problem != e.what()) ROS_ERROR("input/%s: %s", d.wanted->name.c_str(), e.what());
    d.problem = e.what();
  }
}

void InputShell::send(Device& d, double now) {
  sensor_msgs::Joy joy;
  joy.header.stamp = ros::Time::now();
  for (std::size_t i = 0; i < d.wanted->buttons.size(); ++i)
    joy.buttons.push_back(static_cast<int>(d.device->buttons() >> i & 1u));
  for (const double a : d.device->axes()) joy.axes.push_back(static_cast<float>(a));
  d.joy.publish(joy);
  d.last_sent = now;
}

void InputShell::move(Hand& h, double dt) {
  const Device& d = devices_[h.device];
  if (!d.device) return;  // silence: the instrument holds its pose and says so
  h.hand.drive(*h.pad, d.device->axes(), d.device->buttons(), dt);
  geometry_msgs::PoseStamped pose;
  pose.header.stamp = ros::Time::now();
  pose.header.frame_id = frameId("phantom_box");
  const Eigen::Isometry3d X = h.hand.tip();
  const Eigen::Quaterniond q(X.linear());
  pose.pose.position.x = X.translation().x();
  pose.pose.position.y = X.translation().y();
  pose.pose.position.z = X.translation().z();
  pose.pose.orientation.x = q.x();
  pose.pose.orientation.y = q.y();
  pose.pose.orientation.z = q.z();
  pose.pose.orientation.w = q.w();
  h.pose.publish(pose);
  sensor_msgs::JointState jaw;
  jaw.header.stamp = pose.header.stamp;
  jaw.position = {h.hand.jaw()};
  h.jaw.publish(jaw);
}

void InputShell::onTimer() {
  const double now = steadyNow();
  const double dt = last_ < 0.0 ? 0.0 : std::min(now - last_, 0.05);
  last_ = now;
  for (Device& d : devices_) {
    if (!d.device) {
      open(d, now);
      continue;
    }
    const bool changed = d.device->poll(now);
    if (changed || now - d.last_sent >= kHeartbeat - 0.5 * kPeriod) send(d, now);
    if (!d.device->connected()) {
      d.problem = "unplugged: all its buttons count as released";
      ROS_WARN("input/%s: %s", d.wanted->name.c_str(), d.problem.c_str());
      d.device.reset();
      d.next_try = now + kRetry;
    }
  }
  for (Hand& hand : hands_) move(hand, dt);
}

void InputShell::onInstruments(const vest_msgs::InstrumentStates& msg) {
  for (Hand& h : hands_) {
    for (const vest_msgs::InstrumentState& s : msg.instruments) {
      if (s.name != h.instrument || s.source == vest_msgs::InstrumentState::SOURCE_TELEOP) continue;
      h.hand.place(control::Joints(s.joint_position.data()));
    }
  }
}

void InputShell::onDiagnostics() {
  diagnostic_msgs::DiagnosticArray array;
  array.header.stamp = ros::Time::now();
  const double now = steadyNow();
  for (const Device& d : devices_) {
    diagnostic_msgs::DiagnosticStatus status;
    status.name = "input_devices: " + d.wanted->name;
    status.hardware_id = d.device ? d.device->name() : "none";
    status.level = d.device ? status.OK : status.ERROR;
    status.message = d.device ? "connected" : d.problem;
    const std::uint32_t stuck = d.device ? d.device->stuck(now) : 0u;
    for (std::size_t i = 0; i < d.wanted->buttons.size(); ++i) {
      if ((stuck >> i & 1u) == 0) continue;
      status.level = status.WARN;
      status.message += "; stuck: " + d.wanted->buttons[i];
    }
    array.status.push_back(status);
  }
  diagnostics_.publish(array);
}

}  // namespace vest::ros_shell
