// What the instruments say of themselves.
#include <cmath>

#include <diagnostic_msgs/DiagnosticArray.h>

#include "instruments.h"
#include "vest_instruments/ros/command_stamp.h"

namespace vest_instruments {

using vest::control::Instrument;

// A driver that starts anew would name its pedals otherwise than they act here.
void Instruments::watchPreset() {
  std::string preset = "trainer";
  nh_.getParamCached("footswitch_preset", preset);
  const bool renamed = preset != configuration_.footswitch_preset;
  if (renamed && !renamed_)
    ROS_ERROR(
        "%s: changed from '%s' to '%s' while the instruments run: all pedals of the box count as "
        "released until they are started anew",
        nh_.resolveName("footswitch_preset").c_str(), configuration_.footswitch_preset.c_str(),
        preset.c_str());
  renamed_ = renamed;
}

// No reason to hold a hand still: it is measured now, whatever the box's machine takes for the time. Where
// the system clock is set back, the driver's stamps are ahead for long.
bool Instruments::watchBoxClock(double now) {
  constexpr double kSilent = 1.0;  // s, assumed: a box that is gone has no clock
  const bool off =
      std::abs(box_ahead_) > vest::ros_shell::kOldestCommand && last_box_ >= 0.0 && now - last_box_ < kSilent;
  if (off && !box_off_)
    ROS_WARN(
        "phantom_box/joint_states: stamps lie %.1f s %s this machine's clock. Instruments move all the same; "
        "frames and recordings get these times. Set the clock of the box's machine, and start the session "
        "anew",
        std::abs(box_ahead_), box_ahead_ > 0.0 ? "ahead of" : "behind");
  return box_off_ = off;
}

void Instruments::onDiagnostics() {
  watchPreset();
  const double now = steadyNow();
  const bool box_off = watchBoxClock(now);
  if (diagnostics_publisher_.getNumSubscribers() == 0) {
    published_before_ = published_;
    return;
  }
  using diagnostic_msgs::DiagnosticStatus;
  diagnostic_msgs::DiagnosticArray array;
  array.header.stamp = ros::Time::now();
  const auto value = [](DiagnosticStatus& status, const char* key, const std::string& text) {
    diagnostic_msgs::KeyValue kv;
    kv.key = key;
    kv.value = text;
    status.values.push_back(kv);
  };
  for (std::size_t i = 0; i < kCount; ++i) {
    const Instrument& instrument = instruments_[i];
    if (!instrument.present()) continue;
    DiagnosticStatus status;
    status.name = "vest_instruments: " +
                  std::string(vest::tools::instrumentName(static_cast<vest::tools::Instrument>(i)));
    status.hardware_id = "vest";
    status.level = instrument.valid() ? DiagnosticStatus::OK : DiagnosticStatus::WARN;
    status.message = instrument.valid() ? "moving" : "no input: pose held";
    value(status, "source", std::string(vest::control::sourceName(instrument.source())));
    value(status, "tool", std::string(vest::tools::toolName(instrument.tool())));
    value(status, "operating_state",
          std::string(vest::control::operatingStateName(instrument.operatingState())));
    value(status, "input_age_s",
          instrument.lastInput() < 0 ? "none yet" : std::to_string(now - instrument.lastInput()));
    value(status, "refused_commands", std::to_string(crtk_[i]->refused()));
    value(status, "colliding", colliding_[i] ? "true" : "false");
    array.status.push_back(status);
  }
  DiagnosticStatus node;
  node.name = "vest_instruments: node";
  node.hardware_id = "vest";
  std::string silent, two;
  for (std::size_t k = 0; k < pedals_.size(); ++k) {
    // A keyboard's switches are there only while somebody teleoperates.
    const std::string& on = configuration_.inputs.switches[k].on;
    if (pedals_[k].stale(now) && on != "teleop") silent += (silent.empty() ? "" : ", ") + on;
    if (twoPress(k)) two += (two.empty() ? "" : ", ") + on;
  }
  node.level = silent.empty() ? DiagnosticStatus::OK : DiagnosticStatus::WARN;
  node.message = silent.empty() ? "running" : "no switches from " + silent + ": all count as released";
  if (box_off) {
    node.level = DiagnosticStatus::WARN;
    node.message += "; stamps of the box are not of this machine's clock";
  }
  if (!two.empty()) {
    node.level = DiagnosticStatus::ERROR;
    node.message = "two publishers of switches " + two + ": all count as released";
  }
  if (renamed_) {
    node.level = DiagnosticStatus::ERROR;
    node.message = "footswitch_preset was changed: all pedals of the box count as released";
  }
  value(node, "rate_hz", std::to_string(published_ - published_before_));
  value(node, "box_stamps_ahead_s", last_box_ < 0.0 ? "none yet" : std::to_string(box_ahead_));
  value(node, "rejected_inputs", std::to_string(rejected_));
  published_before_ = published_;
  array.status.push_back(node);
  diagnostics_publisher_.publish(array);
}

}  // namespace vest_instruments
