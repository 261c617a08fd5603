#pragma once

namespace vest::haptics {

/// After start, fault or stale data no force is shown until the wanted force was small for several ticks in a
/// row; then it ramps up. So a device that wakes up deep inside tissue, or that a simulation respawns into,
/// stays limp until the hand has come out.
class Gate {
 public:
  static constexpr int kSmallTicks = 20;       ///< assumed: 20 ms at 1 kHz
  static constexpr double kSmallShare = 0.05;  ///< of the device's maximum, assumed
  static constexpr double kRampSeconds = 2.0;  ///< docs/HAZARDS.md, "start while inside tissue"

  /// One tick. @param healthy false closes the gate at once. @param share wanted force over maximum; what is
  /// not a number counts as large. @return allowance, 0 … 1
  double update(bool healthy, double share, double dt) noexcept {
    if (!healthy) {
      close();
      return 0.0;
    }
    if (small_ < kSmallTicks) {
      small_ = share <= kSmallShare ? small_ + 1 : 0;
      return 0.0;
    }
    ramp_ += dt / kRampSeconds;
    if (!(ramp_ < 1.0)) ramp_ = 1.0;
    return ramp_;
  }
  void close() noexcept {
    small_ = 0;
    ramp_ = 0.0;
  }
  bool open() const noexcept { return ramp_ >= 1.0; }
  bool waiting() const noexcept { return small_ < kSmallTicks; }

 private:
  int small_ = 0;
  double ramp_ = 0.0;
};

}  // namespace vest::haptics
