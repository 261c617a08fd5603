#include "vest_instruments/control/instrument.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "vest_instruments/control/pedals.h"
#include "vest_instruments/kinematics/jacobian.h"
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
  constexpr std::array<std::string_view, 8> kTexts{"taken",
                                                   "taken as far as the arm reaches",
                                                   "the instrument is moved by another source",
                                                   "the instrument is not enabled",
                                                   "the instrument is not homed",
                                                   "a value is not finite",
                                                   "the clutch is pressed",
                                                   "the goal is out of reach"};
  return kTexts[static_cast<std::size_t>(verdict)];
}

Joints toJoints(const kinematics::JointPositions& q) {
  return (Joints() << q.yaw, q.pitch, q.insertion, q.roll, q.jaw).finished();
}

kinematics::JointPositions fromJoints(const Joints& q) {
  return {q[0], q[1], q[2], q[3], q[4]};
}

Joints startJoints(const kinematics::TrainerArm& arm) {
  constexpr double kInsertion = 0.1;  // m (assumed)
  kinematics::JointPositions q;
  q.insertion = std::clamp(kInsertion, arm.limits.lower.insertion, arm.limits.upper.insertion);
  const double far = (arm.aim_B - arm.pivot_B).norm();
  // Pivot, tip and aim are a triangle whose angle at the tip is pi minus the optic's: the law of sines.
  if (far > q.insertion)
    q.pitch = std::clamp(arm.optic_angle - std::asin(q.insertion * std::sin(arm.optic_angle) / far),
                         arm.limits.lower.pitch, arm.limits.upper.pitch);
  return toJoints(q);
}

Instrument::Instrument(const kinematics::TrainerArm& arm, Source source)
    : arm_(arm), source_(source), tool_(arm.tool), q_(startJoints(arm)) {
  setpoint_ = previous_ = q_;
}

kinematics::JointLimits Instrument::limits() const {
  kinematics::JointLimits limits = arm_.limits;
  // A tool's jaws may open less far than the handle of the box. Tools without jaws keep the handle's travel:
  // it fires them.
  if (tool_ != tools::ToolKind::Endoscope && tools::toolGeometry(tool_).jaw_length > 0.0)
    limits.upper.jaw = std::min(limits.upper.jaw, tools::toolGeometry(tool_).max_jaw_angle);
  return limits;
}

Joints Instrument::limited(const Joints& q) const {
  const kinematics::JointLimits l = limits();
  return q.cwiseMax(toJoints(l.lower)).cwiseMin(toJoints(l.upper));
}

bool Instrument::within(const Joints& q) const {
  constexpr double kRounding = 1e-6;  // rad, m: a client may send back what it read
  return (limited(q) - q).cwiseAbs().maxCoeff() < kRounding;
}

Verdict Instrument::admit(Source from) const {
  if (from != source_) return Verdict::OtherSource;
  if (state_ != OperatingState::Enabled) return Verdict::NotEnabled;
  if (!homed_) return Verdict::NotHomed;
  return Verdict::Taken;
}

// Takes the place of a move under way; without a fifth value the jaw goes on with its own.
void Instrument::accept(const Joints& q, bool has_fifth, double now) {
  const bool was_busy = busy();
  setpoint_ = limited(q);
  last_input_ = now;
  free_ = arm_move_.active = false;
  if (has_fifth) jaw_move_.active = false;
  if (busy() != was_busy) ++state_revision_;
}

Verdict Instrument::sensedJoints(Source from, const Joints& q, bool has_jaw, const Joints* velocity,
                                 double now) {
  const Verdict verdict = admit(from);
  if (verdict != Verdict::Taken) return verdict;
  if (!q.head<4>().allFinite() || (has_jaw && !std::isfinite(q[4]))) return Verdict::NotFinite;
  Joints wanted = q;
  if (!has_jaw) wanted[4] = setpoint_[4];
  accept(wanted, has_jaw, now);
  has_velocity_ = velocity != nullptr && velocity->allFinite();
  if (has_velocity_) qd_ = *velocity;
  return Verdict::Taken;
}

Verdict Instrument::servoJoints(const Joints& q, bool has_fifth, double now) {
  const Verdict verdict = sensedJoints(Source::Crtk, q, has_fifth, nullptr, now);
  if (verdict != Verdict::Taken) return verdict;
  Joints asked = q;
  if (!has_fifth) asked[4] = setpoint_[4];
  return within(asked) ? Verdict::Taken : Verdict::Limited;
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
  const auto found = inverseKinematics(arm_.X_BTrocar, wanted, fromJoints(setpoint_), arm_.limits);
  accept(toJoints(found.q), false, now);
  has_velocity_ = false;
  return found.reachable || from != Source::Crtk ? Verdict::Taken : Verdict::Limited;
}

Verdict Instrument::servoJaw(Source from, double angle, double now) {
  const Verdict verdict = admit(from);
  if (verdict != Verdict::Taken) return verdict;
  if (!std::isfinite(angle)) return Verdict::NotFinite;
  Joints q = setpoint_;
  q[4] = angle;
  const bool reached = within(q), was_busy = busy();
  setpoint_ = limited(q);
  jaw_move_.active = false;
  if (busy() != was_busy) ++state_revision_;
  last_input_ = now;
  return reached || from != Source::Crtk ? Verdict::Taken : Verdict::Limited;
}

Verdict Instrument::moveJoints(const Joints& q, bool has_fifth, double now) {
  const Verdict verdict = admit(Source::Crtk);
  if (verdict != Verdict::Taken) return verdict;
  Joints goal = q;
  if (!has_fifth) goal[4] = setpoint_[4];
  if (!goal.allFinite()) return Verdict::NotFinite;
  if (!within(goal)) return Verdict::OutOfReach;
  start(arm_move_, limited(goal), 0, 4, now);
  if (has_fifth) start(jaw_move_, limited(goal), 4, 5, now);
  return Verdict::Taken;
}

Verdict Instrument::movePose(const Eigen::Isometry3d& X_BTip, double now) {
  const Verdict verdict = admit(Source::Crtk);
  if (verdict != Verdict::Taken) return verdict;
  if (!X_BTip.matrix().allFinite()) return Verdict::NotFinite;
  const auto found = inverseKinematics(arm_.X_BTrocar, X_BTip, fromJoints(setpoint_), arm_.limits);
  if (!found.reachable) return Verdict::OutOfReach;
  start(arm_move_, limited(toJoints(found.q)), 0, 4, now);
  return Verdict::Taken;
}

Verdict Instrument::moveJaw(double angle, double now) {
  const Verdict verdict = admit(Source::Crtk);
  if (verdict != Verdict::Taken) return verdict;
  if (!std::isfinite(angle)) return Verdict::NotFinite;
  Joints goal = setpoint_;
  goal[4] = angle;
  if (!within(goal)) return Verdict::OutOfReach;
  start(jaw_move_, limited(goal), 4, 5, now);
  return Verdict::Taken;
}

void Instrument::start(Move& move, const Joints& goal, int first, int last, double now) {
  constexpr double kPeak = 1.875;  // greatest slope of the minimum-jerk course
  move = {true, now, 0.0, setpoint_, goal};
  for (int i = first; i < last; ++i) {
    const double speed = i == 2 ? kMoveSpeedInsertion : kMoveSpeed;
    move.time = std::max(move.time, kPeak * std::abs(goal[i] - setpoint_[i]) / speed);
  }
  last_input_ = now;
  has_velocity_ = false;
  if (first == 0) free_ = false;
  ++state_revision_;  // a client waits for busy, be the way ever so short
}

void Instrument::advance(Move& move, int first, int last, double now) {
  if (!move.active) return;
  const double s = move.time > 0.0 ? std::clamp((now - move.start) / move.time, 0.0, 1.0) : 1.0;
  for (int i = first; i < last; ++i)
    setpoint_[i] = s < 1.0 ? move.from[i] + minimumJerk(s) * (move.to[i] - move.from[i]) : move.to[i];
  last_input_ = now;
  if (s < 1.0) return;
  move.active = false;
  if (!busy()) ++state_revision_;
}

Verdict Instrument::hold(double now) {
  const Verdict verdict = admit(Source::Crtk);
  if (verdict != Verdict::Taken) return verdict;
  update(now);
  last_input_ = now;
  free_ = false;
  stop();
  return Verdict::Taken;
}

Verdict Instrument::release(double now) {
  const Verdict verdict = hold(now);
  free_ = verdict == Verdict::Taken;
  return verdict;
}

void Instrument::feel(const Eigen::Matrix<double, 6, 1>& wrench_B, double now) {
  if (!wrench_B.allFinite()) return;
  wrench_B_ = wrench_B;
  felt_ = now;
}

// Each joint gives way to its load, by virtual work J^T · wrench, as fast as a tip that is kYield light: a
// turn about the pivot moves the tip by the insertion per radian.
void Instrument::yield(double now) {
  if (!free_ || state_ != OperatingState::Enabled || felt_ < 0.0 || now - felt_ > kSilence ||
      last_update_ < 0.0)
    return;
  constexpr double kFastest = 0.1;  // m/s: a free arm is damped (assumed)
  const double dt = std::clamp(now - last_update_, 0.0, kSilence);
  const Eigen::Vector4d load =
      kinematics::tipJacobian(arm_.X_BTrocar, fromJoints(setpoint_)).transpose() * wrench_B_;
  const double lever = std::max(setpoint_[2], 0.02);  // m
  const auto speed = [&](double force) { return std::clamp(kYield * force, -kFastest, kFastest); };
  setpoint_[0] += dt * speed(load[0] / lever) / lever;
  setpoint_[1] += dt * speed(load[1] / lever) / lever;
  setpoint_[2] += dt * speed(load[2]);
  setpoint_ = limited(setpoint_);
}

void Instrument::setState(OperatingState state) {
  if (state == state_) return;
  state_ = state;
  ++state_revision_;
}

void Instrument::stop() {
  if (busy()) ++state_revision_;
  arm_move_.active = jaw_move_.active = false;
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
    stop();
    setState(OperatingState::Disabled);
  } else if (word == "pause") {
    if (state_ != OperatingState::Enabled) return false;
    stop();
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
    if (!homed) stop();
  } else {
    return false;
  }
  return true;
}

void Instrument::selectSource(Source source, double now) {
  if (source == source_) return;
  update(now);
  stop();
  free_ = false;
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

bool Instrument::exchangeOptic(double angle) {
  if (arm_.tool != tools::ToolKind::Endoscope || !(angle >= 0 && angle <= kOpticMost)) return false;
  arm_.optic_angle = angle;
  return true;
}

void Instrument::setClutch(bool pressed) {
  clutched_ = pressed;
}

void Instrument::update(double now) {
  advance(arm_move_, 0, 4, now);
  advance(jaw_move_, 4, 5, now);
  yield(now);
  q_ = setpoint_;
  // A simulated arm stays where its client left it, and is somewhere before the first command: with crtk,
  // silence is no fault (decision 0008).
  const bool silent = source_ != Source::Crtk && (last_input_ < 0.0 || now - last_input_ > kSilence);
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
