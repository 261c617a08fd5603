#pragma once

#include <array>
#include <atomic>

#include "vest_haptics/device/device.h"

namespace vest::haptics {

/// A mass on an axis, held by a hand: m·x'' = F + k·(h − x) + c·(h' − x') − b·x' − f·sign(x'). The hand is
/// the usual mass-spring-damper about a wished position h. Defaults are assumed, of the order of wrists that
/// hold a stylus in the literature (some hundred N/m, a few N·s/m, a tenth of a kilogram with the handle).
struct HandAxis {
  double mass = 0.1;              ///< kg (or kg·m²)
  double bare_damping = 0.005;    ///< N·s/m of the mechanism: PHANToM class; assumed
  double hand_stiffness = 300.0;  ///< N/m
  double hand_damping = 3.0;      ///< N·s/m
  double x = 0.0, v = 0.0;        ///< m, m/s
  double friction = 0.0;          ///< N: Coulomb friction of the mechanism
  /// One tick with the force held: implicit midpoint, which keeps the energy balance exactly.
  /// @param h hand's wish, m; @param h_v its speed, m/s
  void advance(double force, double h, double h_v, double dt) noexcept;
  /// J given to the axis is not tracked here: kinetic plus the hand's spring.
  double energy(double h) const noexcept {
    return 0.5 * mass * v * v + 0.5 * hand_stiffness * (h - x) * (h - x);
  }
};

/// Device without hardware: Cartesian, or five joints. advance() moves it; faults can be put in for tests.
///
/// Options: axes (cartesian, joints), motion (rest, press, circle: what the hand wishes, ±10 mm), seconds (of
/// one turn of the motion), maximum_force (N), watchdog (s; 0: none), friction (N, Cartesian: of the
/// mechanism, Coulomb), delay (s, whole ticks: from write() until the force acts), continuous (N that its
/// motors bear for ever; 0: not told).
class SimulatedDevice : public Device {
 public:
  SimulatedDevice();
  void open(const DeviceOptions& options) override;
  void close() override;
  const Capabilities& capabilities() const override { return capabilities_; }
  DeviceStatus read(Sample& sample) noexcept override;
  DeviceStatus write(const Loads& loads) noexcept override;
  void enableForces(bool on) noexcept override { forces_on_ = on; }
  void reset() override { fault_ = DeviceStatus::Ok; }
  void advance(double dt) noexcept override;
  Timing timing() const noexcept override { return timing_; }
  std::string lastError() const override;

  // The hand, and what tests put in.
  void wish(int axis, double position, double speed = 0.0) noexcept;  ///< m or rad; ends the scripted motion
  HandAxis& axis(int i) noexcept { return axes_[static_cast<std::size_t>(i)]; }
  void inject(DeviceStatus status) noexcept { fault_ = status; }
  void spoil(int field,
             double value) noexcept;  ///< the next readings: 0–2 position, 3–6 attitude, 7–11 joints, 12 jaw
  void mend() noexcept { spoiled_ = -1; }
  const Loads& shown() const noexcept { return shown_; }  ///< what acts on the hand now
  double now() const noexcept { return time_; }           ///< s of advance()

 private:
  void script() noexcept;

  Capabilities capabilities_;
  bool open_ = false, forces_on_ = false, scripted_ = false;
  int motion_ = 0;
  double period_ = 4.0, time_ = 0.0, commanded_at_ = -1.0;
  std::array<HandAxis, kChannels> axes_{};
  Loads wish_{}, wish_speed_{}, middle_{}, shown_{};
  static constexpr std::size_t kSlots = 64;
  std::array<Loads, kSlots> under_way_{};
  std::size_t sent_ = 0;  ///< forces under way so far
  double delay_ = 0.0;
  Timing timing_;
  DeviceStatus fault_ = DeviceStatus::Ok;
  int spoiled_ = -1;
  double spoil_value_ = 0.0;
};

}  // namespace vest::haptics
