#include "vest_haptics/loop/controller.h"

#include <algorithm>
#include <cmath>

#include <Eigen/LU>

#include "vest_instruments/kinematics/jacobian.h"

namespace vest::haptics {

using control::OperatingState;
using Eigen::Vector3d;

namespace {

constexpr double kLongestTick = 0.05;      // s: after a pause like this nothing is extrapolated
constexpr double kVelocityFilter = 0.003;  // s, low-pass of the differentiated pose, tuned
constexpr double kTorqueFilter =
    0.010;  // s, of roll and jaw torque, which have no model between updates, tuned
constexpr double kLeastMaximum = 1e-6;

LimiterOptions limiterOptions(const Capabilities& c, const ControllerOptions& o) {
  LimiterOptions limits;
  limits.joints = c.joints;
  limits.maximum = c.maximum;
  // A configured limit only lowers: the device's own maximum stays where it is smaller.
  const double share = o.force_limit > 0.0 ? std::min(1.0, o.force_limit / c.maximum[c.joints ? 2 : 0]) : 1.0;
  for (int i = 0; i < kChannels; ++i) {
    limits.maximum[i] = std::max(kLeastMaximum, share * c.maximum[i]);
    limits.slew_per_tick[i] = limits.maximum[i] * o.period / std::max(o.slew_seconds, 0.020);
  }
  return limits;
}

// m at the tip for a unit of each axis. Of joints: where the axis' maximum equals that along the shaft.
Loads levers(const Capabilities& c) {
  Loads out{1.0, 1.0, 1.0, 1.0, 1.0};
  for (int i = 0; i < kChannels && c.joints; ++i) out[i] = c.maximum[i] / c.maximum[2];
  return out;
}

}  // namespace

std::string_view faultText(Fault fault) {
  switch (fault) {
    case Fault::None:
      return "none";
    case Fault::DeviceError:
      return "the device reports an error";
    case Fault::Sensor:
      return "readings are not finite or jump";
    case Fault::NotFinite:
      return "a force was not finite";
    case Fault::ContactModel:
      return "the simulation's contact model is not believable";
    case Fault::Publisher:
      return "two publishers on a safety topic";
    case Fault::Clock:
      return "the steady clock went back";
  }
  return "?";
}

Controller::Controller(const Capabilities& capabilities, const ControllerOptions& options)
    : capabilities_(capabilities),
      options_(options),
      limiter_(limiterOptions(capabilities, options)),
      sensor_(capabilities),
      passivity_(capabilities.joints ? kChannels : 3, 5.0, levers(capabilities)),
      contact_(coupling(greatest(Timing{}))) {
  report_.stiffness = greatest(Timing{});
}

// N/m at the handle. A device that does not measure: its own rate, and a pose that is a period old.
double Controller::greatest(const Timing& measured) const noexcept {
  const double rated = 1.0 / capabilities_.rate;
  const Timing t = measured.period > 0.0 ? measured : Timing{rated, rated};
  const double damping = capabilities_.damping + options_.configured_damping + options_.hand_damping;
  return std::min(capabilities_.stiffness, greatestStiffness(damping, std::max(t.period, options_.period),
                                                             t.delay + capabilities_.delay));
}

// N/m at the tip: a device that is scaled up makes its hand's motion larger and the force of it, too.
double Controller::coupling(double stiffness) const noexcept {
  const double scale = capabilities_.joints ? 1.0 : options_.scale;
  return stiffness / (scale * scale * options_.force_gain);
}

void Controller::raise(Fault fault) noexcept {
  if (report_.state == OperatingState::Fault) return;
  report_.state = OperatingState::Fault;
  report_.fault = fault;
}

bool Controller::command(Command command) noexcept {
  OperatingState& state = report_.state;
  switch (command) {
    case Command::Disable:
      state = OperatingState::Disabled;
      report_.fault = Fault::None;
      sensor_.reset();
      return true;
    case Command::Enable:
      if (state == OperatingState::Fault) return false;
      state = OperatingState::Enabled;
      return true;
    case Command::Pause:
      if (state != OperatingState::Enabled) return false;
      state = OperatingState::Paused;
      return true;
    case Command::Resume:
      if (state != OperatingState::Paused) return false;
      state = OperatingState::Enabled;
      return true;
  }
  return false;
}

void Controller::pose(const Sample& s) noexcept {
  const kinematics::TrainerArm& arm = options_.arm;
  if (capabilities_.joints) {
    const kinematics::JointPositions q{s.joints[0], s.joints[1], s.joints[2], s.joints[3], s.joints[4]};
    const Eigen::Isometry3d X_BTip = kinematics::forwardKinematics(arm.X_BTrocar, q);
    jacobian_ = kinematics::tipJacobian(options_.X_WB * arm.X_BTrocar, q);
    report_.X_BTip = X_BTip;
  } else {
    report_.X_BTip.linear() =
        capabilities_.orientation ? s.orientation.normalized().toRotationMatrix() : arm.X_BTrocar.linear();
    report_.X_BTip.translation() = arm.aim_B + options_.scale * s.position;
  }
  own_W_ = options_.X_WB * report_.X_BTip.translation();
}

// Virtual work: what the hand does at the device is what the tip does in the tissue.
Loads Controller::toDevice(const Vector3d& force_W, const Vector3d& torque_W,
                           double jaw_torque) const noexcept {
  Loads loads{};
  if (capabilities_.joints) {
    Eigen::Matrix<double, 6, 1> wrench;
    wrench << force_W, torque_W;
    const Eigen::Vector4d q = jacobian_.transpose() * wrench;
    for (int i = 0; i < 4; ++i) loads[i] = q[i];
    loads[4] = jaw_torque;
  } else {
    const Vector3d f = options_.scale * (options_.X_WB.linear().transpose() * force_W);
    for (int i = 0; i < 3; ++i) loads[i] = f[i];
  }
  return loads;
}

void Controller::addTrocar(Loads& loads) const noexcept {
  constexpr double kRest =
      0.002;  // m/s: below it Coulomb friction is viscous, so that it does not chatter (tuned)
  const auto friction = [&](double v) {
    return -options_.trocar_friction * v / (std::abs(v) + kRest) - options_.trocar_viscosity * v;
  };
  if (capabilities_.joints) {
    loads[2] += friction(axis_speed_[2]);
    for (int i = 0; i < kChannels; ++i) {
      if (i == 2) loads[i] -= options_.configured_damping * axis_speed_[i];
    }
    return;
  }
  const Vector3d v(axis_speed_[0], axis_speed_[1], axis_speed_[2]);
  const Vector3d axis = report_.X_BTip.translation() - options_.arm.pivot_B;
  const double length = std::sqrt(axis.squaredNorm());
  Vector3d f = -options_.configured_damping * v;
  if (length > 1e-3) f += axis / length * friction(axis.dot(v) / length);
  for (int i = 0; i < 3; ++i) loads[i] += f[i];
}

double Controller::share(const Loads& loads) const noexcept {
  if (!capabilities_.joints) {
    return std::sqrt(loads[0] * loads[0] + loads[1] * loads[1] + loads[2] * loads[2]) / limiter_.maximum()[0];
  }
  double most = 0.0;
  for (int i = 0; i < kChannels; ++i) {
    most = std::max(most, std::abs(loads[i]) / limiter_.maximum()[i]);
  }
  return most;
}

// Motors warm with the square of their force: what they do not bear for ever is there for some seconds only.
void Controller::spareMotors(Loads& loads) const noexcept {
  constexpr double kBegins = 0.8;  // of the heat that is borne, tuned
  const double c = capabilities_.continuous;
  if (c == 0.0) return;
  const double cool = std::clamp((1.0 - heat_ / (c * c)) / (1.0 - kBegins), 0.0, 1.0);
  const double most = c / limiter_.maximum()[0];
  const double allowed = most + cool * (1.0 - most), beyond = std::max(1.0, share(loads) / allowed);
  for (double& x : loads) x /= beyond;
}

const TickReport& Controller::tick(const TickInput& in) noexcept {
  TickReport& r = report_;
  const bool was_any = any_;
  double dt = 1e-9 * static_cast<double>(in.now_ns - last_ns_);
  const bool pause = !(dt <= kLongestTick);
  if (dt < 0.0) raise(Fault::Clock);
  if (dt < 1e-5) dt = options_.period;
  last_ns_ = in.now_ns;
  any_ = true;
  r.now_ns = in.now_ns;
  r.status = in.status;
  r.limits = 0;

  // What the device measures.
  r.valid = in.status == DeviceStatus::Ok;
  if (in.status == DeviceStatus::Error) raise(Fault::DeviceError);
  if (r.valid) {
    Sample sample = in.sample;
    const SensorCheck::Verdict verdict = sensor_.check(sample, in.now_ns);
    if (verdict == SensorCheck::Verdict::Fault) {
      raise(Fault::Sensor);
      r.valid = false;
    }
    r.sample = sample;
    r.rejected = sensor_.rejected();
  } else {
    sensor_.reset();
  }
  if (r.valid) {
    const Vector3d before = own_W_;
    pose(r.sample);
    Loads axes = r.sample.joints;
    if (!capabilities_.joints) {
      for (int i = 0; i < 3; ++i) axes[i] = r.sample.position[i];
    }
    const double k = dt / (dt + kVelocityFilter);
    if (was_any && !pause) {
      for (int i = 0; i < kChannels; ++i) axis_speed_[i] += k * ((axes[i] - axes_[i]) / dt - axis_speed_[i]);
      velocity_W_ += k * ((own_W_ - before) / dt - velocity_W_);
    } else {
      axis_speed_.fill(0.0);
      velocity_W_.setZero();
    }
    axes_ = axes;
    r.velocity_B = options_.X_WB.linear().transpose() * velocity_W_;
    registration_.push(in.now_ns, own_W_);
  } else {
    any_ = false;  // speeds begin anew
    registration_.reset();
  }

  // What the simulation says.
  bool registered = true, begins = false;
  const bool newer =
      in.image && freshness_.accept(in.image->generation, in.image->step, in.image->steady_ns, in.now_ns);
  r.age = freshness_.age(in.now_ns);
  // What a dead simulation left in the memory is not even looked at.
  if (newer && r.age < kDecayEnds) {
    TissueModel model;
    if (!toModel(in.image->contacts[static_cast<std::size_t>(options_.instrument)], model, &r.detail)) {
      raise(Fault::ContactModel);
    } else if (r.valid) {
      // A reset, another scene or another tool may put it deep into tissue at once.
      begins = model.present && (!present_ || in.image->generation != generation_);
      present_ = model.present;
      generation_ = in.image->generation;
      registered = registration_.observe(in.image->steady_ns, model.commanded, r.allowance > 0.0);
      // Forces along the shaft at whole, moments as what a hand beyond the pivot feels at the tip.
      const Vector3d along = model.position - options_.X_WB * options_.arm.pivot_B;
      const double length = std::sqrt(along.squaredNorm());
      if (length > 1e-3) {
        const Vector3d z = along / length, about_pivot = model.torque + along.cross(model.force);
        model.torque = z * z.dot(model.torque);
        model.force = z * z.dot(model.force) + about_pivot.cross(z) / length;
      }
      contact_.update(model, own_W_ + registration_.offset(), velocity_W_);
    }
  }
  r.step = freshness_.step();
  const double fresh = allowanceForAge(r.age);
  const double served = in.servo_ns >= 0 && !capabilities_.joints
                            ? allowanceForAge(1e-9 * static_cast<double>(in.now_ns - in.servo_ns))
                            : 0.0;
  if (fresh == 0.0) {
    contact_.reset();
    present_ = false;  // a client's forces may hold the gate open meanwhile
  }
  if (fresh < 1.0) r.limits |= kLimitStale;

  // How stiff it may feel.
  constexpr double kChange = 0.02;  // of it, tuned: what is not worth a change
  const double greatest_now = greatest(in.timing);
  if (greatest_now < (1.0 - kChange) * r.stiffness ||
      (greatest_now > (1.0 + kChange) * r.stiffness && !contact_.model().active)) {
    r.stiffness = greatest_now;
    contact_.couple(coupling(r.stiffness), own_W_ + registration_.offset(), velocity_W_);
  }

  // The force.
  r.tip_W = own_W_ + registration_.offset();
  voxel::Motion motion;
  if (in.image && r.valid && registered && !pause && fresh > 0.0) {
    const shared::ContactRecord& record = in.image->contacts[static_cast<std::size_t>(options_.instrument)];
    const std::uint64_t kind = record.feels;
    motion.kind = kind <= static_cast<std::uint64_t>(voxel::Kind::Probe) ? static_cast<voxel::Kind>(kind)
                                                                         : voxel::Kind::None;
    motion.tip = r.tip_W;
    motion.pivot = options_.X_WB * options_.arm.pivot_B;
    motion.reach = isFinite(record.reach) ? std::clamp(record.reach, 0.0, 0.1) : 0.0;
    motion.dt = dt;
    motion.most_stiffness = coupling(r.stiffness);
  }
  const voxel::Felt felt = voxel::step(in.volume, motion, in_volume_);
  Loads wanted{};
  r.force_true_W.setZero();
  if (r.valid && fresh > 0.0) {
    r.force_true_W = contact_.trueForce(r.tip_W, velocity_W_) + felt.force;
    const double k = dt / (dt + kTorqueFilter);
    torque_W_ += k * (contact_.model().torque - torque_W_);
    jaw_torque_ += k * (contact_.model().jaw_torque - jaw_torque_);
    const double gain = options_.force_gain;
    wanted = toDevice(gain * (contact_.evaluate(r.tip_W, velocity_W_, dt) + felt.force), gain * torque_W_,
                      -gain * jaw_torque_);
    addTrocar(wanted);
    // What is beyond the maximum must not keep the decay waiting.
    const double beyond = std::max(1.0, share(wanted));
    for (double& x : wanted) x /= beyond;
  } else {
    torque_W_.setZero();
    jaw_torque_ = 0.0;
  }
  const bool enabled = r.state == OperatingState::Enabled;
  // On its way through the air an instrument feels little, wherever the hand is.
  const bool comes = gate_.waiting() && !contact_.model().arrived;
  const bool healthy =
      enabled && r.valid && !pause && registered && !begins && !comes && (fresh > 0.0 || served > 0.0);
  Loads all = wanted;
  const auto addServo = [&] {
    for (double& x : all) x *= fresh;
    if (served == 0.0) return;  // what is old is not even multiplied: it may be no number
    for (int i = 0; i < 3; ++i) all[i] += served * in.servo_force[i];
  };
  addServo();
  r.allowance = gate_.update(healthy, share(all), dt);
  if (options_.passivity) {
    // Injected damping fades with old data as everything does.
    all = passivity_.update(axes_, axis_speed_, wanted, limiter_.last(),
                            options_.force_gain * (contact_.storedEnergy() + felt.stored), dt);
    addServo();
  }
  r.energy = passivity_.energy();
  r.damping = passivity_.damping();
  if (r.allowance < 1.0) r.limits |= kLimitRamp;
  spareMotors(all);
  r.loads = limiter_.limit(all, r.allowance, r.limits);
  if (r.limits & kLimitNotFinite) raise(Fault::NotFinite);
  if (r.state == OperatingState::Fault) {
    r.limits |= kLimitFault;
    r.loads = limiter_.zero();
    r.allowance = 0.0;
    gate_.close();
    contact_.reset();
  }
  constexpr double kWarm = 10.0;  // s, assumed: windings of motors of this size warm within some ten seconds
  const double force = share(r.loads) * limiter_.maximum()[0];
  heat_ += dt / (kWarm + dt) * (force * force - heat_);
  r.forces_on = r.state == OperatingState::Enabled && r.valid;

  if (capabilities_.joints) {
    const Eigen::Matrix3d lever = jacobian_.topLeftCorner<3, 3>().transpose();
    r.force_shown_W = std::abs(lever.determinant()) > 1e-9
                          ? Vector3d(lever.inverse() * Vector3d(r.loads[0], r.loads[1], r.loads[2]))
                          : Vector3d::Zero();
  } else {
    r.force_shown_W = options_.X_WB.linear() * Vector3d(r.loads[0], r.loads[1], r.loads[2]) / options_.scale;
  }
  return r;
}

}  // namespace vest::haptics
