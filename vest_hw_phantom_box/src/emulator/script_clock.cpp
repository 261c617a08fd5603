#include "vest_hw_phantom_box/emulator/script_clock.h"

#include <algorithm>
#include <cmath>

namespace vest::emulator {

void ScriptClock::hear(double simulated) {
  if (!std::isfinite(simulated)) return;
  if (!simulated_ || simulated < *simulated_) offset_ = simulated - time_;
  if (simulated_ != simulated) told_ = time_;
  simulated_ = simulated;
}

double ScriptClock::at(double wall) {
  const double passed = last_ ? std::max(0.0, wall - *last_) : 0.0;
  last_ = wall;
  if (!simulated_) return time_ += passed;
  const double most = std::min(*simulated_ - offset_, told_) + kLead;
  time_ = std::max(time_, std::min(time_ + passed, most));
  // Once hands have moved, not before: who was not let run hears of much at once, and then sends what it
  // owes.
  offset_ = std::max(offset_, *simulated_ - time_ - kBehind);
  return time_;
}

}  // namespace vest::emulator
