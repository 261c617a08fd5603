#include "vest_bringup/session/clock_watch.h"

#include <chrono>
#include <cmath>

namespace vest::session {

std::optional<ClockWatch::Jump> ClockWatch::look(double system, double steady) {
  const double offset = system - steady;
  const double by = begun_ ? offset - offset_ : 0.0;
  begun_ = true;
  offset_ = offset;  // a slewed clock is followed
  if (std::fabs(by) < kJump) return std::nullopt;
  total_ += by;
  totals_.push_back(total_);
  jumps_.push_back({steady, by});
  return jumps_.back();
}

double ClockWatch::line(double stamp, double steady) const {
  const double expected = steady + offset_ - total_;
  double best = stamp - total_;
  for (const double total : totals_) {
    if (std::fabs(stamp - total - expected) < std::fabs(best - expected)) best = stamp - total;
  }
  return best;
}

double steadySeconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

std::optional<ClockReading> readClocks() {
  for (int i = 0; i < 10; ++i) {
    const double before = steadySeconds();
    const double system =
        std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count();
    const double after = steadySeconds();
    if (after - before < 1e-3) return ClockReading{system, 0.5 * (before + after)};
  }
  return std::nullopt;
}

}  // namespace vest::session
