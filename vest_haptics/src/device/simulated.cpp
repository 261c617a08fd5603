#include "vest_haptics/device/simulated.h"

#include <algorithm>
#include <cmath>

namespace vest::haptics {

void HandAxis::advance(double force, double h, double h_v, double dt) noexcept {
  constexpr int kSub = 16;
  const double s = dt / kSub, c = hand_damping + bare_damping, most = s * friction;
  for (int i = 0; i < kSub; ++i) {
    const double x_old = x, v_old = v;
    // Implicit midpoint of a linear system: exact energy balance of force, damper and springs.
    const double k = hand_stiffness;
    const double rhs =
        force + k * (h + 0.5 * s * h_v - x_old - 0.5 * s * v_old) + hand_damping * h_v - c * v_old;
    const double inertia = mass + 0.5 * s * c + 0.25 * s * s * k;
    // Friction holds the middle of the sub-step still where it can, and else takes all that it has.
    const double hold = -2.0 * v_old * inertia - s * rhs;
    const double dv = (s * rhs + std::clamp(hold, -most, most)) / inertia;
    v = v_old + dv;
    x = x_old + s * 0.5 * (v + v_old);
    h += s * h_v;
  }
}

SimulatedDevice::SimulatedDevice() {
  capabilities_.model = "simulated";
  capabilities_.maximum = {3.3, 0, 0, 0, 0};
  capabilities_.orientation = true;
  capabilities_.jaw = true;
  capabilities_.buttons = 2;
  capabilities_.workspace = {0.08, 0.06, 0.035, 0, 0};
  capabilities_.stiffness = 2000.0;
}

void SimulatedDevice::open(const DeviceOptions& options) {
  checkOptions("simulated device", options,
               "axes motion seconds maximum_force watchdog friction delay continuous");
  const std::string axes = option(options, "axes", "cartesian"), motion = option(options, "motion", "rest");
  if (axes != "cartesian" && axes != "joints")
    throw DeviceError("simulated device: axes '" + axes + "'; allowed: cartesian, joints");
  if (motion != "rest" && motion != "press" && motion != "circle")
    throw DeviceError("simulated device: motion '" + motion + "'; allowed: rest, press, circle");
  motion_ = motion == "rest" ? 0 : motion == "press" ? 1 : 2;
  period_ = numberOption(options, "seconds", 4.0, 0.1, 1000.0);
  const double force = numberOption(options, "maximum_force", 3.3, 0.01, 100.0);
  capabilities_.watchdog = numberOption(options, "watchdog", 0.0, 0.0, 10.0);
  const double friction = numberOption(options, "friction", 0.0, 0.0, 5.0);
  capabilities_.continuous = numberOption(options, "continuous", 0.0, 0.0, 100.0);
  delay_ = numberOption(options, "delay", 0.0, 0.0, 0.06);
  timing_ = {0.001, delay_};
  capabilities_.joints = axes == "joints";
  capabilities_.maximum = {force, 0, 0, 0, 0};
  middle_.fill(0.0);
  if (capabilities_.joints) {
    // A lever of some 0.12 m between trocar and tip turns force into torque.
    capabilities_.maximum = {0.12 * force, 0.12 * force, force, 0.05, 0.2};
    capabilities_.workspace = {0.6, 0.6, 0.06, 1.5, 0.5};
    middle_ = {0.0, 0.0, 0.12, 0.0, 0.5};
    for (int i : {0, 1, 3, 4}) axes_[static_cast<std::size_t>(i)] = {0.0015, 1e-4, 4.0, 0.04, 0.0, 0.0};
    capabilities_.orientation = capabilities_.jaw = false;
  }
  wish_ = middle_;
  for (int i = 0; i < kChannels; ++i) {
    axes_[static_cast<std::size_t>(i)].x = middle_[static_cast<std::size_t>(i)];
    axes_[static_cast<std::size_t>(i)].v = 0.0;
    axes_[static_cast<std::size_t>(i)].friction = capabilities_.joints ? 0.0 : friction;
  }
  scripted_ = motion_ != 0;
  time_ = 0.0;
  open_ = true;
  forces_on_ = false;
  shown_.fill(0.0);
  under_way_.fill(Loads{});
  sent_ = 0;
  fault_ = DeviceStatus::Ok;
}

void SimulatedDevice::close() {
  open_ = forces_on_ = false;
  shown_.fill(0.0);
}

DeviceStatus SimulatedDevice::read(Sample& sample) noexcept {
  if (!open_) return DeviceStatus::Starting;
  if (fault_ != DeviceStatus::Ok) return fault_;
  Sample s;
  for (int i = 0; i < 3; ++i) s.position[i] = axes_[static_cast<std::size_t>(i)].x;
  if (capabilities_.joints) {
    s.position.setZero();
    for (std::size_t i = 0; i < kChannels; ++i) s.joints[i] = axes_[i].x;
  } else {
    s.orientation = Eigen::Quaterniond(0.0, 1.0, 0.0, 0.0);  // shaft straight down
    s.jaw = 0.6;
  }
  if (spoiled_ >= 0) {
    if (spoiled_ < 3)
      s.position[spoiled_] = spoil_value_;
    else if (spoiled_ < 7)
      s.orientation.coeffs()[spoiled_ - 3] = spoil_value_;
    else if (spoiled_ < 12)
      s.joints[static_cast<std::size_t>(spoiled_ - 7)] = spoil_value_;
    else
      s.jaw = spoil_value_;
  }
  sample = s;
  return DeviceStatus::Ok;
}

DeviceStatus SimulatedDevice::write(const Loads& loads) noexcept {
  if (!open_) return DeviceStatus::Starting;
  if (fault_ == DeviceStatus::Error) forces_on_ = false;
  commanded_at_ = time_;
  Loads& last = under_way_[sent_ % kSlots];
  last = forces_on_ && fault_ == DeviceStatus::Ok ? loads : Loads{};
  if (delay_ == 0.0) shown_ = last;
  return fault_;
}

std::string SimulatedDevice::lastError() const {
  return fault_ == DeviceStatus::Error ? "error put in by a test" : "";
}

void SimulatedDevice::wish(int axis, double position, double speed) noexcept {
  scripted_ = false;
  wish_[static_cast<std::size_t>(axis)] = position;
  wish_speed_[static_cast<std::size_t>(axis)] = speed;
}

void SimulatedDevice::spoil(int field, double value) noexcept {
  spoiled_ = field;
  spoil_value_ = value;
}

void SimulatedDevice::script() noexcept {
  const double phase = 6.283185307179586 * time_ / period_;
  wish_ = middle_;
  if (motion_ == 1) {  // up and down, or along the shaft: 20 mm, downwards first
    wish_[2] += capabilities_.joints ? 0.01 * (1.0 - std::cos(phase)) : -0.01 * (1.0 - std::cos(phase));
  } else {
    const double r = capabilities_.joints ? 0.08 : 0.01;
    wish_[0] += r * std::sin(phase);
    wish_[1] += r * (std::cos(phase) - 1.0);
  }
}

void SimulatedDevice::advance(double dt) noexcept {
  if (!open_) return;
  time_ += dt;
  timing_.period = dt;
  if (delay_ > 0.0) {
    const auto ticks = static_cast<std::size_t>(std::lround(delay_ / dt));
    shown_ = ticks < kSlots && ticks <= sent_ ? under_way_[(sent_ - ticks) % kSlots] : Loads{};
    const Loads held = under_way_[sent_ % kSlots];
    under_way_[++sent_ % kSlots] = held;
  }
  if (scripted_) script();
  if (capabilities_.watchdog > 0.0 && time_ - commanded_at_ > capabilities_.watchdog) shown_.fill(0.0);
  if (!forces_on_) shown_.fill(0.0);
  for (std::size_t i = 0; i < (capabilities_.joints ? 5u : 3u); ++i) {
    axes_[i].advance(shown_[i], wish_[i], wish_speed_[i], dt);
    wish_[i] += wish_speed_[i] * dt;
  }
}

}  // namespace vest::haptics
