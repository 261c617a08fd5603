#include "vest_haptics/safety/passivity.h"

#include <algorithm>

namespace vest::haptics {

double greatestStiffness(double damping, double period, double delay) noexcept {
  return damping / (0.5 * period + delay);
}

void Passivity::reset() noexcept {
  any_ = false;
  energy_ = damping_ = 0.0;
}

Loads Passivity::update(const Loads& positions, const Loads& speeds, const Loads& wanted, const Loads& shown,
                        double stored, double dt) noexcept {
  Loads out = wanted;
  damping_ = 0.0;
  if (any_) {
    double flow = 0.0, square = 0.0, norm = 0.0;
    for (int i = 0; i < dimension_; ++i) {
      const double v = levers_[i] * speeds[i];
      flow -= shown[i] * (positions[i] - last_[i]);
      square += v * v;
      norm += shown[i] * shown[i];
    }
    energy_ += flow;
    if (norm == 0.0) energy_ = 0.0;  // nothing is shown, nothing is stored
    if (energy_ > stored) energy_ = stored;
    if (energy_ < 0.0 && square > 0.0) {
      // α·v²·T = −W
      damping_ = std::min(-energy_ / (square * dt), most_damping_);
      for (int i = 0; i < dimension_; ++i) out[i] -= damping_ * levers_[i] * levers_[i] * speeds[i];
    }
  }
  last_ = positions;
  any_ = true;
  return out;
}

}  // namespace vest::haptics
