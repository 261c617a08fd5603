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
/// A second guard stands here: whatever the loop does, a force that is older than kCommandLife is replaced by
/// zero, so a loop that died leaves a limp device as long as the process lives; and one beyond the maximum is
/// replaced by zero too, whatever went wrong before.
class MailboxDevice : public Device {
 public:
  static constexpr double kCommandLife = 0.020;  ///< s: docs/HAZARDS.md, "haptic loop dies"
  static constexpr double kReadingLife = 0.020;  ///< s: older readings mean unplugged

  const Capabilities& capabilities() const override { return capabilities_; }
  DeviceStatus read(Sample& sample) noexcept override;
  DeviceStatus write(const Loads& loads) noexcept override;
  void enableForces(bool on) noexcept override { forces_on_ = on; }
  std::uint32_t errorCode() const noexcept override { return code_; }
  std::string lastError() const override;

 protected:
  // For the serving thread.
  void deliver(const Sample& sample, std::int64_t now_ns) noexcept;
  void setStatus(DeviceStatus status) noexcept { status_ = static_cast<int>(status); }
  /// Latches an error. The text is made later, by describe().
  void fail(std::uint32_t code) noexcept;
  /// What is to be shown now: zero where forces are off, an error is latched, or the command is too old
  /// or beyond the maximum.
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
  struct Reading {
    Sample sample;
    std::int64_t ns = -1;
  };
  struct Wanted {
    Loads loads{};
    std::int64_t ns = -1;
  };
  scene::TripleBuffer<Reading> readings_;
  scene::TripleBuffer<Wanted> wanted_;
  std::atomic<int> status_{static_cast<int>(DeviceStatus::Starting)};
  std::atomic<std::uint32_t> code_{0};
  std::atomic<bool> forces_on_{false};
};

}  // namespace vest::haptics
