#pragma once

#include <atomic>
#include <mutex>
#include <string>

#include "vest_haptics/device/device.h"
#include "vest_tissue/scene/ring.h"

namespace vest::haptics {

/// Devices that are served by a thread of their own (a maker's scheduler, a serial line, calls that wait for
/// USB): that thread and the loop exchange readings and forces without waiting for each other.
///
/// A second guard stands here. Whatever the loop does, zero is served where the force is older than
/// kCommandLife, so a loop that died leaves a limp device as long as the process lives; where it is beyond
/// the maximum, whatever went wrong before; and where no pose came for kPoseLife or the device is not well,
/// because then nobody knows where the hand is.
///
/// Beside it the true delay is measured: the age, at every moment, of the pose behind the force that is
/// shown. Its mean is T/2 + t_d.
class MailboxDevice : public Device {
 public:
  static constexpr double kCommandLife = 0.020;  ///< s: docs/HAZARDS.md, "haptic loop dies"
  static constexpr double kReadingLife = 0.020;  ///< s: older readings mean unplugged
  static constexpr double kPoseLife = 0.010;     ///< s: as long as a spoiled reading is held (sensor_check.h)

  const Capabilities& capabilities() const override { return capabilities_; }
  DeviceStatus read(Sample& sample) noexcept override;
  DeviceStatus write(const Loads& loads) noexcept override;
  void enableForces(bool on) noexcept override { forces_on_ = on; }
  std::uint32_t errorCode() const noexcept override { return code_; }
  std::string lastError() const override;
  Timing timing() const noexcept override { return {period_, delay_}; }

 protected:
  // For the serving thread.
  void deliver(const Sample& sample, std::int64_t now_ns) noexcept;
  void setStatus(DeviceStatus status) noexcept { status_ = static_cast<int>(status); }
  /// Latches an error. The text is made later, by describe().
  void fail(std::uint32_t code) noexcept;
  /// What is to be shown now: zero where forces are off, an error is latched, the device is not well, its
  /// newest pose or the command is too old, or the command is beyond the maximum. One thread, as the force
  /// goes out: the delay is measured here.
  Loads wanted(std::int64_t now_ns) noexcept;
  bool forcesOn() const noexcept { return forces_on_ && code_ == 0; }

  // For the ordinary thread.
  void begin() noexcept;  ///< before the serving thread starts
  void clearError() noexcept { code_ = 0; }
  virtual std::string describe(std::uint32_t code) const = 0;
  static std::int64_t steadyNow() noexcept;

  Capabilities capabilities_;

 private:
  bool withinMaximum(const Loads& loads) const noexcept;
  void measure(std::int64_t posed_ns, std::int64_t now_ns) noexcept;
  struct Reading {
    Sample sample;
    std::int64_t ns = -1;
  };
  struct Wanted {
    Loads loads{};
    std::int64_t ns = -1;
    std::int64_t posed_ns = -1;  ///< when the pose was measured that it was computed from
  };
  scene::TripleBuffer<Reading> readings_;
  scene::TripleBuffer<Wanted> wanted_;
  std::atomic<int> status_{static_cast<int>(DeviceStatus::Starting)};
  std::atomic<std::uint32_t> code_{0};
  std::atomic<bool> forces_on_{false};
  std::atomic<std::int64_t> delivered_ns_{-1};
  std::int64_t read_ns_ = -1;  ///< of the loop: its newest reading
  std::int64_t posed_ns_ = -1,
               served_ns_ = -1;    ///< of the serving thread: pose and moment of the last new force
  double lag_ = 0.0, held_ = 0.0;  ///< s, means
  std::atomic<double> period_{0.0}, delay_{0.0};  ///< s
};

}  // namespace vest::haptics
