// Device time to ROS time, without jitter and never backwards.
#pragma once

#include <cstdint>

namespace vest::driver {

/// Extends the box's 32 bit microseconds, and maps them to the wall clock.
///
/// The offset between device and steady clock is the least delay seen so far (a frame can arrive late, not
/// early), allowed to grow by kDrift because both quartzes drift. A box without a quartz drifts more: every
/// kWindow the offset is the least delay of that time, so stamps lag by what its clock loses in two of them.
/// Wall time enters through a second offset that follows the wall clock slowly, so that a clock that is set
/// back never makes a stamp go back.
class TimeMap {
 public:
  /// Two quartzes of ±100 ppm (usual tolerance of crystals and of PC clocks; assumed).
  static constexpr double kDrift = 200e-6;
  /// ns (assumed): so long no line holds up every frame. An oscillator of 1 % (of a microcontroller alone)
  /// loses 5 ms in it.
  static constexpr std::int64_t kWindow = 500000000;
  /// Wall clock slew that is followed: ntpd and chrony correct running clocks by at most 500 ppm by default.
  static constexpr double kSlew = 500e-6;
  /// A frame cannot lie longer than this on the way: a larger delay means that the device clock stood still,
  /// ns.
  static constexpr std::int64_t kMaxDelay = 2000000000;

  /// Stamp in ns of the wall clock for a sample taken at device time `time_us` that arrived now.
  std::int64_t stamp(std::uint32_t time_us, std::int64_t steady_now_ns, std::int64_t wall_now_ns);
  /// Device time, extended to 64 bit, of the last sample, ns.
  std::int64_t device() const { return device_ns_; }
  /// Wall clock minus what the stamps follow, ns: large after the clock was set.
  std::int64_t wallStep() const { return wall_step_; }
  /// A new connection: device time starts anew; stamps still never go back.
  void reset() { has_device_ = false; }

 private:
  bool has_device_ = false;
  bool has_wall_ = false;
  std::uint32_t last_us_ = 0;
  std::int64_t device_ns_ = 0;
  std::int64_t steady_minus_device_ = 0;
  std::int64_t begin_ = 0, least_delay_ = INT64_MAX;  ///< of the window
  std::int64_t wall_minus_steady_ = 0;
  std::int64_t last_steady_ = 0;
  std::int64_t wall_step_ = 0;
  std::int64_t last_stamp_ = INT64_MIN;
};

}  // namespace vest::driver
