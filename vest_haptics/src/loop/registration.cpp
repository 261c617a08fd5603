#include "vest_haptics/loop/registration.h"

#include <algorithm>

namespace vest::haptics {

void Registration::reset() noexcept {
  next_ = count_ = 0;
  offset_.setZero();
}

void Registration::push(std::int64_t now_ns, const Eigen::Vector3d& own) noexcept {
  ring_[next_].ns = now_ns;
  ring_[next_].own = own;
  next_ = (next_ + 1) % kSlots;
  count_ = std::min(count_ + 1, kSlots);
}

bool Registration::observe(std::int64_t step_ns, const Eigen::Vector3d& commanded) noexcept {
  const auto window = static_cast<std::int64_t>(kWindow * 1e9);
  double best = -1.0;
  for (std::size_t i = 0; i < count_; ++i) {
    const Entry& e = ring_[i];
    if (e.ns > step_ns || step_ns - e.ns > window) continue;
    const double d = (commanded - offset_ - e.own).squaredNorm();
    if (best < 0.0 || d < best) best = d;
  }
  if (best < 0.0) return false;
  if (best <= kTolerance * kTolerance) return true;
  // The newest own pose is the best guess: a clutch is let go by a hand that hardly moves.
  offset_ = commanded - ring_[(next_ + kSlots - 1) % kSlots].own;
  return false;
}

}  // namespace vest::haptics
