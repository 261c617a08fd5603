#include "vest_haptics/safety/freshness.h"

#include <limits>

namespace vest::haptics {

double allowanceForAge(double age) noexcept {
  if (!(age < kDecayEnds)) return 0.0;  // also NaN
  if (age <= kDecayBegins) return 1.0;
  return (kDecayEnds - age) / (kDecayEnds - kDecayBegins);
}

bool Freshness::accept(std::uint64_t generation, std::uint64_t step, std::int64_t steady_ns,
                       std::int64_t now_ns) noexcept {
  if (steady_ns > now_ns + static_cast<std::int64_t>(kFutureTolerance * 1e9)) return false;
  if (any_) {
    if (generation < generation_) return false;
    if (generation == generation_ && step <= step_) return false;
    if (steady_ns <= steady_ns_) return false;
  }
  any_ = true;
  generation_ = generation;
  step_ = step;
  steady_ns_ = steady_ns;
  return true;
}

double Freshness::age(std::int64_t now_ns) const noexcept {
  if (!any_) return std::numeric_limits<double>::infinity();
  return 1e-9 * static_cast<double>(now_ns - steady_ns_);
}

}  // namespace vest::haptics
