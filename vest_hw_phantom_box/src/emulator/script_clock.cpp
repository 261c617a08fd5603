#include "vest_hw_phantom_box/emulator/script_clock.h"

#include <algorithm>
#include <cmath>

namespace vest::emulator {
namespace {
constexpr double kLately = 0.2;  ///< s: longer than the heaps in which messages come (assumed)
}

void ScriptClock::hear(double simulated) {
  if (!std::isfinite(simulated)) return;
  if (!simulated_ || simulated < *simulated_) {
    offset_ = simulated - time_;
    seen_ = simulated, speed_ = 1.0, told_ = time_;
  } else if (simulated > *simulated_) {
    told_ = time_;
  }
  simulated_ = simulated;
}

double ScriptClock::at(double wall) {
  const double passed = last_ ? std::max(0.0, wall - *last_) : 0.0;
  last_ = wall;
  if (!simulated_) return time_ += passed;
  if (passed > 0.0)
    speed_ += std::min(1.0, passed / kLately) * ((*simulated_ - seen_) / passed - speed_),
        seen_ = *simulated_;
  offset_ = std::max(offset_, *simulated_ - time_ - kBehind);
  const double there = *simulated_ - offset_;
  const double rate = time_ < there - kLead ? kHaste * std::clamp(speed_, 0.0, 1.0) : 1.0;
  time_ = std::max(time_, std::min({time_ + rate * passed, there + kLead, told_ + kLead}));
  return time_;
}

}  // namespace vest::emulator
