#pragma once

#include <cstdint>

#include "vest_haptics/device/device.h"

namespace vest::haptics {

/// Believes only readings that a hand can make: finite, a rotation where there is one, and no jump. A
/// rejected reading is replaced by the last good one for at most 10 ms; then it is a fault.
class SensorCheck {
 public:
  static constexpr double kHold = 0.010;  ///< s: docs/HAZARDS.md, "sensor NaN or jump"
  /// Fastest motions believed: assumed, some five times those of hands in box training (0.3 m/s, 5 rad/s); a
  /// blow against the handle's stop may come near.
  static constexpr double kSpeed = 3.0;      ///< m/s
  static constexpr double kTurnRate = 60.0;  ///< rad/s
  /// Steps of sensors and of jitter between two readings.
  static constexpr double kSlack = 0.0005;    ///< m
  static constexpr double kTurnSlack = 0.02;  ///< rad

  enum class Verdict { Good, Held, Fault };

  explicit SensorCheck(const Capabilities& capabilities)
      : joints_(capabilities.joints), orientation_(capabilities.orientation), jaw_(capabilities.jaw) {}

  /// Takes a reading; on Held and Fault `sample` is the last good one. The first good reading is believed.
  Verdict check(Sample& sample, std::int64_t now_ns) noexcept;
  /// Forgets the last good reading.
  void reset() noexcept {
    any_ = false;
    bad_since_ = -1;
  }
  std::uint64_t rejected() const noexcept { return rejected_; }

 private:
  bool believable(const Sample& sample, double dt) const noexcept;

  bool joints_, orientation_, jaw_;
  bool any_ = false;
  Sample good_;
  std::int64_t good_ns_ = 0, bad_since_ = -1;
  std::uint64_t rejected_ = 0;
};

}  // namespace vest::haptics
