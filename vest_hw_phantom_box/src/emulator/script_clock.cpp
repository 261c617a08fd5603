#include "vest_hw_phantom_box/emulator/script_clock.h"

#include <algorithm>
#include <cmath>

namespace vest::emulator {

void ScriptClock::hear(double simulated) {
  if (!std::isfinite(simulated)) return;
  if (!simulated_ || simulated < *simulated_) offset_ = simulated - time_;
  simulated_ = simulated;
  // Behind it, it takes up from there: what counts is how fast hands move to tissue.
  offset_ = std::max(offset_, simulated - time_);
}

double ScriptClock::at(double wall) {
  const double passed = last_ ? std::max(0.0, wall - *last_) : 0.0;
  last_ = wall;
  const double next = time_ + passed;
  time_ = simulated_ ? std::max(time_, std::min(next, *simulated_ - offset_ + kLead)) : next;
  return time_;
}

}  // namespace vest::emulator
