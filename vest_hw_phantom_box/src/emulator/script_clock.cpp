#include "vest_hw_phantom_box/emulator/script_clock.h"

#include <algorithm>
#include <cmath>

namespace vest::emulator {

void ScriptClock::hear(double wall, double simulated, double rate) {
  if (!std::isfinite(simulated) || !std::isfinite(rate)) return;
  const bool back = heard_ && simulated < simulated_;  // reset, or another scene
  const bool silent = !heard_ || wall - *heard_ > kSilence;
  heard_ = wall, simulated_ = simulated, rate_ = std::clamp(rate, 0.0, 1.0);
  if (back || silent) offset_.reset();
}

double ScriptClock::at(double wall) {
  const double passed = last_ ? std::max(0.0, wall - *last_) : 0.0;
  last_ = wall;
  if (!heard_ || wall - *heard_ > kSilence) {
    offset_.reset();
    return time_ += passed;
  }
  const double simulated = simulated_ + rate_ * (wall - *heard_);
  // Behind it, it takes up from there: what counts is how fast hands move to tissue.
  if (!offset_ || simulated - *offset_ > time_) offset_ = simulated - time_;
  // Ahead of it, it goes slower; a lead of less than a twentieth of a second is none.
  const double lead = time_ - (simulated - *offset_);
  const double free = rate_ > 0.95 && lead < 0.05 ? 1.0 : rate_ - lead / kAdapts;
  return time_ += passed * std::clamp(free, 0.0, 1.0);
}

}  // namespace vest::emulator
