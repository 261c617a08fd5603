/// How old the contact model is, and what force that still allows.
#pragma once

#include <cstdint>

namespace vest::haptics {

inline constexpr double kDecayBegins = 0.020;      ///< s of age: docs/HAZARDS.md, "simulation dies, hangs"
inline constexpr double kDecayEnds = 0.050;        ///< s of age: no force from here on
inline constexpr double kFutureTolerance = 0.001;  ///< s: a stamp later than this from now is refused

/// Share of the force that data of this age allows: 1 up to 20 ms, 0 from 50 ms, linear between. Anything
/// that is not a number counts as 0.
double allowanceForAge(double age) noexcept;

/// Judges images by simulation step and by steady time, never by arrival: a solver that hangs while something
/// still sends, and messages that come out of a queue late, are both dead.
class Freshness {
 public:
  /// True where this is a newer step than any before, with a stamp that fits. @param now_ns, steady_ns
  /// CLOCK_MONOTONIC
  bool accept(std::uint64_t generation, std::uint64_t step, std::int64_t steady_ns,
              std::int64_t now_ns) noexcept;
  /// s since the step of the newest accepted image began; infinite before the first.
  double age(std::int64_t now_ns) const noexcept;
  std::uint64_t step() const noexcept { return step_; }
  std::uint64_t generation() const noexcept { return generation_; }

 private:
  bool any_ = false;
  std::uint64_t generation_ = 0, step_ = 0;
  std::int64_t steady_ns_ = 0;
};

}  // namespace vest::haptics
