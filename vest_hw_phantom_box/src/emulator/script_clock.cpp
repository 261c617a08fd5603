#include "vest_hw_phantom_box/emulator/script_clock.h"

#include <algorithm>
#include <cmath>

namespace vest::emulator {

void ScriptClock::hear(double simulated) {
  if (!std::isfinite(simulated)) return;
  if (!simulated_ || simulated < *simulated_) offset_ = simulated - time_;
  simulated_ = simulated;
}

double ScriptClock::at(double wall) {
  const double passed = last_ ? std::max(0.0, wall - *last_) : 0.0;
  last_ = wall;
  if (!simulated_) return time_ += passed;
  const double most = std::min(time_ + std::min(passed, kLead), *simulated_ - offset_ + kLead);
  time_ = std::max(time_, most);
  // By what is heard now and not before the hands have moved: who was not let run would take that for a lag.
  offset_ = std::max(offset_, *simulated_ - time_ - kBehind);
  return time_;
}

}  // namespace vest::emulator
