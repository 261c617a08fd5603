#include "vest_instruments/control/instrument.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "vest_instruments/control/pedals.h"
#include "vest_instruments/tools/tool_geometry.h"

namespace vest::control {
namespace {

constexpr std::array<std::string_view, 6> kSourceNames{"none", "box", "haptic", "crtk", "teleop", "replay"};

/// Minimum-jerk course from 0 to 1 (Flash and Hogan, J. Neurosci. 5(7), 1985).
double minimumJerk(double s) {
  return s * s * s * (10.0 + s * (-15.0 + 6.0 * s));
}

}  // namespace

std::string_view sourceName(Source source) {
  const auto i = static_cast<std::size_t>(source);
  return i < kSourceNames.size() ? kSourceNames[i] : kSourceNames[0];
}

std::optional<Source> sourceFromName(std::string_view name) {
  for (std::size_t i = 0; i < kSourceNames.size(); ++i) {
    if (kSourceNames[i] == name) return static_cast<Source>(i);
  }
  return std::nullopt;
}

std::optional<Source> sourceFromValue(std::uint8_t value) {
  if (value >= kSourceNames.size()) return std::nullopt;
  return static_cast<Source>(value);
}

std::string_view operatingStateName(OperatingState state) {
  constexpr std::array<std::string_view, 4> kNames{"DISABLED", "ENABLED", "PAUSED", "FAULT"};
  return kNames[static_cast<std::size_t>(state)];
}

std::string_view verdictText(Verdict verdict) {
  constexpr std::array<std::string_view, 6> kTexts{"taken",
                                                   "the instrument is moved by another source",
                                                   "the instrument is not enabled",
                                                   "the instrument is not homed",
                                                   "a value is not finite",
                                                   "the clutch is pressed"};
  return kTexts[static_cast<std::size_t>(verdict)];
}

Joints toJoints(const kinematics::JointPositions& q) {
  return (Joints() << q.yaw, q.pitch, q.insertion, q.roll, q.jaw).finished();
}

kinematics::JointPositions fromJoints(const Joints& q) {
  return {q[0], q[1], q[2], q[3], q[4]};
}

Instrument::Instrument(const kinematics::TrainerArm& arm, Source source)
    : arm_(arm), source_(source), tool_(arm.tool) {
  q_ << 0.0, 0.0, std::clamp(kStartInsertion, arm.limits.lower.insertion, arm.limits.upper.insertion), 0.0,
      0.0;
  setpoint_ = previous_ = move_from_ = move_to_ = q_;
}

Joints Instrument::limited(Joints q) const {
  const Joints lower = toJoints(arm_.limits.lower);
  Joints upper = toJoints(arm_.limits.upper);
  // A tool's jaws may open less far than the handle of the box.
  if (tool_ != tools::ToolKind::Endoscope)
    upper[4] = std::min(upper[4], tools::toolGeometry(tool_).max_jaw_angle);
  // Tools without jaws keep the handle's travel: it fires them.
  if (tool_ != tools::ToolKind::Endoscope && tools::toolGeometry(tool_).jaw_length == 0.0) {
    upper[4] = arm_.limits.upper.jaw;
  }
  return q.cwiseMax(lower).cwiseMin(upper);
}

Verdict Instrument::admit(Source from) const {
  if (from != source_) return Verdict::OtherSource;
  if (state_ != OperatingState::Enabled) return Verdict::NotEnabled;
  if (!homed_) return Verdict::NotHomed;
  return Verdict::Taken;
}

void Instrument::accept(const Joints& q, double now) {
  setpoint_ = limited(q);
  last_input_ = now;
  if (moving_) setBusy(false);
}

Verdict Instrument::sensedJoints(Source from, const Joints& q, bool has_jaw, const Joints* velocity,
                                 double now) {
  const Verdict verdict = admit(from);
  if (verdict != Verdict::Taken) return verdict;
  if (!q.head<4>().allFinite() || (has_jaw && !std::isfinite(q[4]))) return Verdict::NotFinite;
  Joints wanted = q;
  if (!has_jaw) wanted[4] = setpoint_[4];
  accept(wanted, now);
  has_velocity_ = velocity != nullptr && velocity->allFinite();
  if (has_velocity_) qd_ = *velocity;
  return Verdict::Taken;
}

Verdict Instrument::servoJoints(const Joints& q, bool has_fifth, double now) {
  return sensedJoints(Source::Crtk, q, has_fifth, nullptr, now);
}

Verdict Instrument::servoPose(Source from, const Eigen::Isometry3d& X_BTip, double now) {
  const Verdict verdict = admit(from);
  if (verdict != Verdict::Taken) return verdict;
  if (!X_BTip.matrix().allFinite()) return Verdict::NotFinite;
  Eigen::Isometry3d wanted = X_BTip;
  if (from != Source::Crtk) {  // a hand that may be re-centred by the clutch
    last_input_ = now;
    if (clutched_) {
      rebase_ = true;
      return Verdict::Clutched;
    }
    if (rebase_) clutch_offset_B_ = setpointTip().translation() - X_BTip.translation();
    rebase_ = false;
    wanted.translation() += clutch_offset_B_;
  }
  accept(toJoints(inverseKinematics(arm_.X_BTrocar, wanted, fromJoints(setpoint_), arm_.limits).q), now);
  has_velocity_ = false;
  return Verdict::Taken;
}

Verdict Instrument::servoJaw(Source from, double angle, double now) {
  const Verdict verdict = admit(from);
  if (verdict != Verdict::Taken) return verdict;
  if (!std::isfinite(angle)) return Verdict::NotFinite;
  Joints q = setpoint_;
  q[4] = angle;
  setpoint_ = limited(q);
  move_to_[4] = move_from_[4] = setpoint_[4];
  last_input_ = now;
  return Verdict::Taken;
}

Verdict Instrument::moveJoints(const Joints& q, bool has_fifth, double now) {
  const Verdict verdict = admit(Source::Crtk);
  if (verdict != Verdict::Taken) return verdict;
  Joints goal = q;
  if (!has_fifth) goal[4] = setpoint_[4];
  if (!goal.allFinite()) return Verdict::NotFinite;
  startMove(limited(goal), now);
  return Verdict::Taken;
}

Verdict Instrument::movePose(const Eigen::Isometry3d& X_BTip, double now) {
  const Verdict verdict = admit(Source::Crtk);
  if (verdict != Verdict::Taken) return verdict;
  if (!X_BTip.matrix().allFinite()) return Verdict::NotFinite;
  startMove(
      limited(toJoints(inverseKinematics(arm_.X_BTrocar, X_BTip, fromJoints(setpoint_), arm_.limits).q)),
      now);
  return Verdict::Taken;
}

void Instrument::startMove(const Joints& goal, double now) {
  move_from_ = setpoint_;
  move_to_ = goal;
  move_start_ = now;
  last_input_ = now;
  has_velocity_ = false;
  constexpr double kPeak = 1.875;  // greatest slope of the minimum-jerk course
  move_time_ = 0.0;
  for (int i = 0; i < 5; ++i) {
    const double speed = i == 2 ? kMoveSpeedInsertion : kMoveSpeed;
    move_time_ = std::max(move_time_, kPeak * std::abs(goal[i] - move_from_[i]) / speed);
  }
  setBusy(true);
}

Verdict Instrument::hold(double now) {
  const Verdict verdict = admit(Source::Crtk);
  if (verdict != Verdict::Taken) return verdict;
  update(now);
  last_input_ = now;
  setBusy(false);
  return Verdict::Taken;
}

void Instrument::setState(OperatingState state) {
  if (state == state_) return;
  state_ = state;
  ++state_revision_;
}

void Instrument::setBusy(bool busy) {
  if (busy == moving_) return;
  moving_ = busy;
  ++state_revision_;
}

bool Instrument::stateCommand(std::string_view word, double now) {
  constexpr std::string_view kSourcePrefix = "source:";
  if (word.substr(0, kSourcePrefix.size()) == kSourcePrefix) {
    const auto source = sourceFromName(word.substr(kSourcePrefix.size()));
    if (source) selectSource(*source, now);
    return source.has_value();
  }
  if (word == "enable") {
    if (state_ == OperatingState::Fault) return false;
    setState(OperatingState::Enabled);
  } else if (word == "disable") {
    setBusy(false);
    setState(OperatingState::Disabled);
  } else if (word == "pause") {
    if (state_ != OperatingState::Enabled) return false;
    setBusy(false);
    setState(OperatingState::Paused);
  } else if (word == "resume") {
    if (state_ != OperatingState::Paused) return false;
    setState(OperatingState::Enabled);
  } else if (word == "home" || word == "unhome") {
    // Sensors of the box are absolute and other sources know their zero: homing moves nothing.
    if (state_ != OperatingState::Enabled) return false;
    const bool homed = word == "home";
    if (homed != homed_) ++state_revision_;
    homed_ = homed;
    if (!homed) setBusy(false);
  } else {
    return false;
  }
  return true;
}

void Instrument::selectSource(Source source, double now) {
  if (source == source_) return;
  update(now);
  setBusy(false);
  source_ = source;
  setpoint_ = q_;
  has_velocity_ = false;
  last_input_ = -1.0;
  valid_ = false;
  rebase_ = true;  // a hand takes the instrument over where it is
}

bool Instrument::exchangeTool(tools::ToolKind tool) {
  if (arm_.tool == tools::ToolKind::Endoscope || tool == tools::ToolKind::Endoscope) return false;
  tool_ = tool;
  was_open_ = fires_ = false;
  setpoint_ = limited(setpoint_);
  return true;
}

void Instrument::setClutch(bool pressed) {
  clutched_ = pressed;
}

void Instrument::update(double now) {
  if (moving_) {
    const double s = move_time_ > 0.0 ? std::clamp((now - move_start_) / move_time_, 0.0, 1.0) : 1.0;
    const double jaw = setpoint_[4];
    setpoint_ = move_from_ + minimumJerk(s) * (move_to_ - move_from_);
    if (move_from_[4] == move_to_[4]) setpoint_[4] = jaw;
    last_input_ = now;
    if (s >= 1.0) setBusy(false);
  }
  q_ = setpoint_;
  // A simulated arm stays where its client left it: with crtk, silence is no fault (decision 0110).
  const bool silent = last_input_ < 0.0 || (source_ != Source::Crtk && now - last_input_ > kSilence);
  valid_ = !silent && source_ != Source::None && state_ == OperatingState::Enabled && homed_;
  const double dt = now - last_update_;
  if (!valid_) {
    qd_.setZero();
    has_velocity_ = false;
  } else if (!has_velocity_ && last_update_ >= 0.0 && dt > 0.0) {
    constexpr double kFilter = 0.02;  // s
    qd_ += std::min(1.0, dt / (kFilter + dt)) * ((q_ - previous_) / dt - qd_);
  }
  if (dt > 0.0 || last_update_ < 0.0) {
    previous_ = q_;
    last_update_ = now;
  }
  constexpr double kOpen = 0.15,
                   kClosed = 0.05;  // rad of the handle, apart so that noise does not fire (assumed)
  if (q_[4] > kOpen) was_open_ = true;
  fires_ = valid_ && was_open_ && q_[4] < kClosed && (functionsOf(tool_) & tools::kFunctionFire) != 0;
}

}  // namespace vest::control
