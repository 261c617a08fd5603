#include "vest_haptics/device/sensor_check.h"

#include <cmath>

namespace vest::haptics {

bool SensorCheck::believable(const Sample& s, double dt) const noexcept {
  const double reach = kSpeed * dt + kSlack, turn = kTurnRate * dt + kTurnSlack;
  if (joints_) {
    for (int i = 0; i < kChannels; ++i) {
      if (!isFinite(s.joints[i])) return false;
      if (any_ && !(std::abs(s.joints[i] - good_.joints[i]) <= (i == 2 ? reach : turn))) return false;
    }
    return true;
  }
  for (int i = 0; i < 3; ++i) {
    if (!isFinite(s.position[i])) return false;
  }
  if (any_ && !((s.position - good_.position).squaredNorm() <= reach * reach)) return false;
  if (orientation_) {
    // A coefficient that is not finite fails here too.
    if (!(std::abs(s.orientation.squaredNorm() - 1.0) <= 0.02)) return false;
    // Half the angle between two attitudes has the cosine |q1·q2|.
    const double c = std::abs(s.orientation.dot(good_.orientation));
    if (any_ && turn < 3.0 && !(c >= std::cos(0.5 * turn) * 0.98)) return false;
  }
  if (jaw_) {
    if (!isFinite(s.jaw)) return false;
    if (any_ && !(std::abs(s.jaw - good_.jaw) <= turn)) return false;
  }
  return true;
}

SensorCheck::Verdict SensorCheck::check(Sample& sample, std::int64_t now_ns) noexcept {
  const double dt = 1e-9 * static_cast<double>(now_ns - good_ns_);
  if (believable(sample, dt > 0.0 ? dt : 0.0)) {
    good_ = sample;
    good_ns_ = now_ns;
    any_ = true;
    bad_since_ = -1;
    return Verdict::Good;
  }
  ++rejected_;
  if (bad_since_ < 0) bad_since_ = now_ns;
  sample = good_;
  const bool held = any_ && now_ns - bad_since_ <= static_cast<std::int64_t>(kHold * 1e9);
  return held ? Verdict::Held : Verdict::Fault;
}

}  // namespace vest::haptics
