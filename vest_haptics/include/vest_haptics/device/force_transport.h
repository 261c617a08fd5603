/// How forces get to a Laparoscopic Impulse Engine. Its force protocol is not public, so this is a plug of
/// its own: a lab that has the maker's documents writes one class and one C function.
///
///     extern "C" vest::haptics::ForceTransport* vest_force_transport() { return new Mine; }
///
/// in a shared library that the device's option `force` names by its path.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>

#include "vest_haptics/device/device.h"
#include "vest_haptics/device/tty.h"

namespace vest::haptics {

class ForceTransport {
 public:
  virtual ~ForceTransport() = default;
  /// Once, and after each write that failed: close() and this by the writing thread, ten times a second until
  /// it succeeds. @param port option `force_port` @param maximum N·m, N·m, N, N·m, N·m. @throws DeviceError
  virtual void open(const std::string& port, const Loads& maximum) = 0;
  virtual void close() = 0;
  /// Loads on the hand: yaw, pitch, insertion, roll, jaw. Called up to 1000 times a second by a thread of its
  /// own, from open() to close(), also while the position line is dead: then with zero. May wait a little.
  /// False: the device is gone.
  virtual bool write(const Loads& loads) noexcept = 0;
  /// s after the last write at which the device itself drops to zero; 0: it does not.
  virtual double watchdog() const = 0;
  /// s from a write until the force acts, where known: it lowers the stiffness that can be shown.
  virtual double delay() const { return 0.0; }
};

/// Force frames of the emulator, 14 bytes: 0xA5 · sequence · 5 × int16 (little-endian, share of the maximum ×
/// 32767) · CRC-16 (0x1021, start 0xFFFF, over the 12 bytes before, little-endian).
namespace force_frame {
inline constexpr std::size_t kSize = 14;
void encode(std::uint8_t sequence, const Loads& loads, const Loads& maximum, std::uint8_t* out) noexcept;
/// False where length, mark or CRC do not fit.
bool decode(const std::uint8_t* bytes, const Loads& maximum, std::uint8_t& sequence, Loads& loads) noexcept;
}  // namespace force_frame

/// To the emulator of this package.
class EmulatorTransport : public ForceTransport {
 public:
  void open(const std::string& port, const Loads& maximum) override;
  void close() override { tty_.close(); }
  bool write(const Loads& loads) noexcept override;
  double watchdog() const override { return 0.020; }

 private:
  Tty tty_;
  Loads maximum_{};
  std::uint8_t sequence_ = 0;
};

}  // namespace vest::haptics
