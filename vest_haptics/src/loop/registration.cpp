#include "vest_haptics/loop/registration.h"

#include <algorithm>
#include <cmath>

namespace vest::haptics {

void Registration::reset() noexcept {
  ring_.fill(Entry{});
  next_ = 0;
  offset_.setZero();
}

void Registration::push(std::int64_t now_ns, const Eigen::Vector3d& own) noexcept {
  ring_[next_].ns = now_ns;
  ring_[next_].own = own;
  next_ = (next_ + 1) % kSlots;
}

bool Registration::observe(std::int64_t step_ns, const Eigen::Vector3d& commanded, bool shown) noexcept {
  const auto window = static_cast<std::int64_t>(kWindow * 1e9);
  const Eigen::Vector3d& newest = ring_[(next_ + kSlots - 1) % kSlots].own;
  const double passed = 1e-9 * static_cast<double>(step_ns - observed_ns_);
  observed_ns_ = step_ns;
  Eigen::Vector3d apart = Eigen::Vector3d::Zero();
  double best = -1.0, spread = 0.0;
  for (const Entry& e : ring_) {
    if (e.ns > step_ns || step_ns - e.ns > window) continue;
    const Eigen::Vector3d from = commanded - offset_ - e.own;
    const double d = from.squaredNorm();
    if (best < 0.0 || d < best) best = d, apart = from;
    spread = std::max(spread, (e.own - newest).squaredNorm());
  }
  if (best < 0.0) return false;
  if (best > kTolerance * kTolerance) {
    // The newest own pose is the best guess: a clutch is let go by a hand that hardly moves.
    offset_ = commanded - newest;
    return false;
  }
  if (spread > kStill * kStill) return true;
  const double way = std::sqrt(best), most = shown ? kFollow * passed : way;
  if (way > most) apart *= most / way;
  offset_ += apart;
  return true;
}

}  // namespace vest::haptics
