#include "phantom_box_shell.h"

#include <diagnostic_msgs/DiagnosticArray.h>
#include <sensor_msgs/JointState.h>
#include <sensor_msgs/Joy.h>

#include <algorithm>

namespace vest::ros_shell {

using driver::BoxState;
using protocol::kAxes;
using protocol::kFootswitches;
using protocol::kJoints;

PhantomBoxShell::PhantomBoxShell(ros::NodeHandle nh, ros::NodeHandle private_nh)
    : parameters_(readParameters(nh, private_nh)) {
  joint_states_ = nh.advertise<sensor_msgs::JointState>("phantom_box/joint_states", 100);
  footswitches_ = nh.advertise<sensor_msgs::Joy>("phantom_box/footswitches", 100);
  diagnostics_ = nh.advertise<diagnostic_msgs::DiagnosticArray>("/diagnostics", 10);
  for (int i = 0; i < kFootswitches; ++i) {
    pedals_[i] = nh.advertise<sensor_msgs::Joy>("footpedals/" + parameters_.pedals[i], 10, true);
    onPedal({i, 0});  // latched: whoever comes later knows that it is up
  }
  reader_ = std::make_unique<driver::BoxReader>(parameters_.calibration, parameters_.reader, *this);
  last_diagnostics_ = ros::SteadyTime::now();
  thread_ = std::thread([this] { reader_->run(); });
  timer_ = nh.createSteadyTimer(ros::WallDuration(1.0), &PhantomBoxShell::publishDiagnostics, this);
}

PhantomBoxShell::~PhantomBoxShell() {
  timer_.stop();
  reader_->stop();
  thread_.join();
}

ros::Time PhantomBoxShell::stampOf(const driver::Driver& driver, driver::Nanoseconds arrived) {
  if (ros::Time::isSimTime()) return ros::Time::now();
  if (driver.epoch() != epoch_) time_map_.reset();
  epoch_ = driver.epoch();
  const ros::WallTime wall = ros::WallTime::now();
  ros::Time stamp;
  stamp.fromNSec(static_cast<std::uint64_t>(
      time_map_.stamp(driver.sample().time_us, arrived, static_cast<std::int64_t>(wall.toNSec()))));
  return stamp;
}

void PhantomBoxShell::onSample(const driver::Driver& driver, driver::Nanoseconds arrived) {
  const auto message = boost::make_shared<sensor_msgs::JointState>();
  const driver::Sample& sample = driver.sample();
  message->header.stamp = stampOf(driver, arrived);
  message->name.reserve(kJoints);
  message->position.reserve(kJoints);
  message->velocity.reserve(kJoints);
  for (int arm = 0; arm <= protocol::kMaxInstruments; ++arm) {
    // An instrument with a broken sensor has no pose: all of it is left out, nothing is invented. The light
    // post turns only the picture and stands for itself.
    const int first = arm * kAxes;
    const int needed = arm == protocol::kMaxInstruments ? 4 : kAxes;
    bool whole = true;
    for (int i = first; i < first + needed; ++i) whole &= driver.usable(i);
    for (int i = first; i < first + kAxes; ++i) {
      if (i < first + needed ? !whole : !driver.usable(i)) continue;
      message->name.push_back(protocol::jointNames()[i]);
      message->position.push_back(sample.joints[i].position);
      message->velocity.push_back(sample.joints[i].velocity);
    }
  }
  if (!message->name.empty()) joint_states_.publish(message);
}

void PhantomBoxShell::onFootswitches(std::uint8_t pressed) {
  const auto message = boost::make_shared<sensor_msgs::Joy>();
  message->header.stamp = ros::Time::now();
  message->buttons.resize(kFootswitches);
  for (int i = 0; i < kFootswitches; ++i) message->buttons[i] = (pressed >> i) & 1;
  footswitches_.publish(message);
}

void PhantomBoxShell::onPedal(const driver::PedalEvent& event) {
  const auto message = boost::make_shared<sensor_msgs::Joy>();
  message->header.stamp = ros::Time::now();
  message->buttons.assign(1, event.value);
  pedals_[event.pedal].publish(message);
}

void PhantomBoxShell::onMessage(Severity severity, const std::string& text) {
  if (silent_) return;
  switch (severity) {
    case Severity::kInfo:
      ROS_INFO("phantom_box: %s", text.c_str());
      break;
    case Severity::kWarning:
      ROS_WARN("phantom_box: %s", text.c_str());
      break;
    case Severity::kError:
      ROS_ERROR("phantom_box: %s", text.c_str());
      break;
  }
}

void PhantomBoxShell::publishDiagnostics(const ros::SteadyTimerEvent&) {
  const driver::ReaderStatus s = reader_->status();
  const ros::SteadyTime now = ros::SteadyTime::now();
  const double dt = std::max(1e-3, (now - last_diagnostics_).toSec());
  const double rate = static_cast<double>(s.wire.motions - last_status_.wire.motions) / dt;
  const auto crc = s.wire.crc_errors - last_status_.wire.crc_errors;
  const auto lost = s.wire.lost - last_status_.wire.lost;
  const auto rejected = s.driver.rejected - last_status_.driver.rejected;
  const auto gaps = s.gaps - last_status_.gaps;

  diagnostic_msgs::DiagnosticStatus d;
  d.name = "phantom_box: trainer box";
  d.hardware_id = s.has_box ? s.box.serial_number : "unknown";
  d.level = d.OK;
  d.message = toString(s.state);
  const auto warn = [&](const std::string& text) {
    d.level = std::max<std::uint8_t>(d.level, d.WARN);
    d.message += "; " + text;
  };
  if (s.state != BoxState::kRunning) d.level = s.state == BoxState::kSettling ? d.WARN : d.ERROR;
  if (!s.port_error.empty()) d.message += ": port '" + parameters_.reader.port + "': " + s.port_error;
  if (s.state == BoxState::kFault) d.message += ": " + s.unusable;
  if (crc) warn(std::to_string(crc) + " CRC errors in the last second");
  if (gaps) warn(std::to_string(gaps) + " gaps of more than 20 ms between good frames in the last second");
  if (lost) warn(std::to_string(lost) + " frames lost in the last second");
  if (rejected) warn(std::to_string(rejected) + " sensor readings rejected in the last second");
  if (s.state == BoxState::kRunning && rate < 0.9 * s.box.rate_hz) warn("rate below what the box promises");
  if (s.status & protocol::kPedalsMissing) warn("footswitches not connected");
  if (s.status & protocol::kOverrun) warn("the box reports lost samples");
  std::string stuck;
  for (int i = 0; i < kFootswitches; ++i)
    if (s.stuck & (1u << i)) stuck += (stuck.empty() ? "" : " ") + parameters_.pedals[i];
  if (!stuck.empty()) warn("footswitch stuck: " + stuck);

  const auto add = [&](const char* key, const std::string& value) {
    diagnostic_msgs::KeyValue kv;
    kv.key = key;
    kv.value = value;
    d.values.push_back(kv);
  };
  add("port", parameters_.reader.port);
  add("state", toString(s.state));
  add("rate [Hz]", std::to_string(rate));
  add("promised rate [Hz]", std::to_string(s.box.rate_hz));
  add("instruments", std::to_string(s.box.instruments));
  add("age of last good frame [ms]", s.age < 0 ? "never" : std::to_string(static_cast<double>(s.age) * 1e-6));
  add("frames", std::to_string(s.wire.frames));
  add("CRC errors", std::to_string(s.wire.crc_errors));
  add("lost frames", std::to_string(s.wire.lost));
  add("repeated frames", std::to_string(s.wire.repeated));
  add("skipped bytes", std::to_string(s.wire.skipped));
  add("reconnects", std::to_string(s.reconnects));
  add("gaps of more than 20 ms", std::to_string(s.gaps));
  add("rejected readings", std::to_string(s.driver.rejected));
  add("sensor faults", std::to_string(s.driver.faults));
  add("readings beyond limits", std::to_string(s.driver.clamped));
  add("unusable joints", s.unusable);
  add("stuck footswitches", stuck);
  diagnostic_msgs::DiagnosticArray array;
  array.header.stamp = ros::Time::now();
  array.status.push_back(d);
  diagnostics_.publish(array);
  last_status_ = s;
  last_diagnostics_ = now;
}

}  // namespace vest::ros_shell
