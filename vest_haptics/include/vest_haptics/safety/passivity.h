/// Stability of sampled contact: a bound on stiffness, and an observer of the energy that really flows.
#pragma once

#include "vest_haptics/safety/limiter.h"

namespace vest::haptics {

/// Greatest stiffness, N/m, that a spring may have whose force reaches the hand a time t_d after its pose and
/// is then held for a period T: b > K·(T/2 + t_d). Without delay: Colgate and Schenkel, "Passivity of a class
/// of sampled-data systems", J. Robotic Systems 14(1), 1997, with no virtual damper; with delay: Gil,
/// Sánchez, Hulin, Preusche and Hirzinger, "Stability boundary for haptic rendering: influence of damping and
/// delay", J. Computing and Information Science in Engineering 9(1), 2009. T/2 + t_d is the mean age of the
/// pose behind the force, so the spring gives K·v²·(T/2 + t_d) of power to a hand that moves through it by v.
/// @param damping N·s/m: the mechanism's, the configured and the hand's. @param period, delay s
double greatestStiffness(double damping, double period, double delay) noexcept;

/// Time-domain passivity observer and controller (Hannaford and Ryu, IEEE Trans. Robotics and Automation
/// 18(1), 2002, impedance form), with the energy of a held force: over one period the hand receives exactly
/// F(k−1)·(x(k) − x(k−1)). Ours: the surplus that may be returned later is bounded by what a spring can have
/// stored, so that long friction does not hide an instability; axes of different units are damped alike at
/// the tip, by levers; and the damping acts on a low-passed speed, because a step of an encoder within a tick
/// is no motion of the hand.
class Passivity {
 public:
  /// @param dimension 3 or 5. @param most_damping N·s/m that may be injected. @param levers m of motion at
  /// the tip for a unit of each axis: 1 for a length
  Passivity(int dimension, double most_damping, const Loads& levers = {1.0, 1.0, 1.0, 1.0, 1.0})
      : dimension_(dimension), most_damping_(most_damping), levers_(levers) {}

  /// One tick. @param positions measured now (m or rad). @param speeds low-passed, m/s or rad/s. @param
  /// wanted what the model asks for. @param shown what the device has held since the last tick. @param stored
  /// J: most that the contact can give back.
  /// @return wanted plus injected damping
  Loads update(const Loads& positions, const Loads& speeds, const Loads& wanted, const Loads& shown,
               double stored, double dt) noexcept;
  void reset() noexcept;
  double energy() const noexcept { return energy_; }    ///< J taken from the hand and not yet returned
  double damping() const noexcept { return damping_; }  ///< N·s/m injected in the last tick

 private:
  int dimension_;
  double most_damping_;
  Loads levers_;
  bool any_ = false;
  Loads last_{};
  double energy_ = 0.0, damping_ = 0.0;
};

}  // namespace vest::haptics
