// The box as the rest of the suite sees it: checked joints, pedals, state. No ROS, no clock of its own.
#pragma once

#include <array>
#include <cstdint>

#include "vest_hw_phantom_box/calibration/calibration.h"
#include "vest_hw_phantom_box/driver/footswitches.h"
#include "vest_hw_phantom_box/protocol/frame.h"

namespace vest::driver {

struct DriverOptions {
  Nanoseconds hold = 10 * kMillisecond;   ///< a rejected reading is replaced by the last good one this long
  Nanoseconds stale = 20 * kMillisecond;  ///< no good frame for this long: the box is gone
  int settle = 20;                        ///< consistent readings before a faulted joint counts again
  double velocity_time_constant =
      0.005;  ///< s, low-pass of the differences (assumed: hides one count of noise)
  FootswitchOptions footswitches;
};

enum class BoxState {
  kDisconnected,  ///< port not open
  kNoHello,       ///< port open, nothing known about the box yet
  kIncompatible,  ///< another major version of the protocol
  kStale,         ///< no good frame for DriverOptions::stale
  kSettling,      ///< frames come; after a start or a hole in them joints are left out until they settled
  kFault,         ///< frames come, but at least one joint reads what cannot be
  kRunning
};
const char* toString(BoxState state);

struct JointReading {
  double position = 0;  ///< rad or m, within the calibrated limits
  double velocity = 0;  ///< rad/s or m/s
  bool usable = false;  ///< measured, or held for at most DriverOptions::hold
};

/// All joints at one device time.
struct Sample {
  std::uint32_t time_us = 0;
  std::array<JointReading, protocol::kJoints> joints;
};

struct DriverCounters {
  std::uint64_t rejected = 0;    ///< single readings: flagged, no reading, not finite, or a jump
  std::uint64_t faults = 0;      ///< times that a joint became unusable
  std::uint64_t clamped = 0;     ///< readings beyond the calibrated limits
  std::uint64_t mismatched = 0;  ///< motion frames that do not fit the hello frame
};

/// State of one box. Every call takes the steady time; nothing here allocates or blocks.
class Driver {
 public:
  explicit Driver(const calibration::Calibration& calibration, const DriverOptions& options = {});

  void connected(Nanoseconds now);
  void disconnected(Nanoseconds now);
  void hello(const protocol::Hello& hello, Nanoseconds now);
  /// True if sample() is new. One frame gives at most one sample; a lost frame gives none.
  bool motion(const protocol::Motion& motion, Nanoseconds now);
  /// Lets time pass: pedals grow old.
  void tick(Nanoseconds now);

  BoxState state(Nanoseconds now) const;
  const Sample& sample() const { return sample_; }
  /// The joint exists in box and calibration.
  bool has(int joint) const;
  /// Exists, and can be used.
  bool usable(int joint) const { return has(joint) && sample_.joints[joint].usable; }
  const protocol::Hello& box() const { return hello_; }
  /// Grows whenever the device clock begins anew: times before and after cannot be compared.
  std::uint64_t epoch() const { return epoch_; }
  bool hasHello() const { return has_hello_; }
  std::uint8_t status() const { return status_; }
  /// Since the last good frame; −1 before the first.
  Nanoseconds age(Nanoseconds now) const { return has_frame_ ? now - last_frame_ : -1; }
  Footswitches& footswitches() { return footswitches_; }
  const DriverCounters& counters() const { return counters_; }

 private:
  struct Guard {
    bool accepted = false;  ///< the joint has been usable and not faulted since
    double last_raw = 0;    ///< last reading that was a number, before clamping
    std::int64_t last_raw_us = 0;
    bool has_raw = false;
    double good = 0;           ///< last accepted reading with its turns, before clamping
    std::int64_t good_us = 0;  ///< its device time
    int settled = 0;           ///< consistent readings in a row
    bool broken = false;       ///< the last reading but good ones was flagged, missing or a jump
    double velocity = 0;
  };
  void joint(int index, const protocol::Motion& motion, bool box_usable);
  void forgetMotion();

  calibration::Calibration calibration_;
  DriverOptions options_;
  Footswitches footswitches_;
  protocol::Hello hello_;
  bool connected_ = false;
  bool has_hello_ = false;
  bool has_frame_ = false;
  bool has_time_ = false;
  bool joint_fault_ = false, settling_ = false;
  std::uint8_t status_ = 0;
  std::uint64_t epoch_ = 0;
  std::uint32_t last_us_ = 0;
  std::int64_t device_us_ = 0;
  Nanoseconds last_frame_ = 0;
  std::array<Guard, protocol::kJoints> guards_;
  Sample sample_;
  DriverCounters counters_;
};

}  // namespace vest::driver
