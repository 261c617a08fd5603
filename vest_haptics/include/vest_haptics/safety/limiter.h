/// The last stage before a device: whatever comes in, what goes out is finite, within the device's maximum
/// and within its rate of change.
#pragma once

#include <array>
#include <cstdint>

namespace vest::haptics {

/// Channels of a device's output. Cartesian: force x y z in N (channels 3, 4 stay 0). Joints: yaw, pitch in
/// N·m, insertion in N, roll in N·m, jaw in N·m.
inline constexpr int kChannels = 5;
using Loads = std::array<double, kChannels>;

/// Why the output differs from what was asked for; values of vest_msgs/HapticState.limits.
enum LimitFlag : std::uint32_t {
  kLimitNotFinite = 1,
  kLimitMagnitude = 2,
  kLimitSlew = 4,
  kLimitRamp = 8,
  kLimitStale = 16,
  kLimitFault = 32,
};

/// True where the exponent is not all ones. Looks at bits, so no compiler flag can argue it away.
bool isFinite(double x) noexcept;

struct LimiterOptions {
  bool joints = false;    ///< each channel for itself; else the norm of the first three
  Loads maximum{};        ///< N or N·m, > 0 for channels that exist; Cartesian: maximum[0] is the norm's
  Loads slew_per_tick{};  ///< N or N·m a tick; likewise
};

/// Guarantees, for any bit pattern of input: output finite, magnitude ≤ maximum, change since the last output
/// ≤ slew_per_tick. Where the input is not finite or the allowance is 0 the output is zero at once.
class Limiter {
 public:
  explicit Limiter(const LimiterOptions& options) : options_(options) {}

  /// @param wanted any bits. @param allowance share of the wanted force that may be shown, 0 … 1; anything
  /// else counts as 0. @param flags bits are added. Real-time safe.
  Loads limit(const Loads& wanted, double allowance, std::uint32_t& flags) noexcept;
  /// Zero at once; the next output starts from there.
  Loads zero() noexcept;
  const Loads& last() const noexcept { return last_; }
  const Loads& maximum() const noexcept { return options_.maximum; }

 private:
  LimiterOptions options_;
  Loads last_{};
};

}  // namespace vest::haptics
