#pragma once

#include <memory>
#include <thread>

#include "vest_haptics/device/force_transport.h"
#include "vest_haptics/device/hci.h"
#include "vest_haptics/device/mailbox_device.h"
#include "vest_haptics/device/tty.h"

namespace vest::haptics {

/// Laparoscopic Impulse Engine, five axes: yaw, pitch, insertion, roll, jaw. Position by the serial HCI
/// protocol; force by a ForceTransport, because the maker's force protocol is not public. Two lines, a thread
/// for each: forces go out whatever the position line does, and are zero while no positions come. Not tried
/// on hardware.
///
/// Options: port; baud (115200); force (none, emulator, or the path of a library with a transport);
/// force_port; counts (five numbers: counts per rad or m, sign included); home (five numbers: rad or m where
/// the encoders read half their range); maximum_force (N along the shaft).
class ImpulseEngineDevice : public MailboxDevice {
 public:
  ImpulseEngineDevice();
  ~ImpulseEngineDevice() override;
  void open(const DeviceOptions& options) override;
  void close() override;
  void reset() override { clearError(); }
  std::string calibrationHint() const override {
    return "hold the handle in its home position and open the device again";
  }

 private:
  static constexpr std::uint32_t kForceGone = 1;
  bool connect();
  void serve();
  void serveForces();
  bool reopenForces() noexcept;
  std::string describe(std::uint32_t code) const override;

  std::string port_, force_port_;
  unsigned baud_ = 115200;
  Loads counts_{}, home_{};
  Tty tty_;
  void* library_ = nullptr;
  std::unique_ptr<ForceTransport> transport_;
  std::atomic<bool> stop_{false};
  std::int64_t silent_since_ = 0;
  std::string product_;  ///< of the serving thread until capabilities are asked for
  std::thread thread_, forces_;
};

}  // namespace vest::haptics
