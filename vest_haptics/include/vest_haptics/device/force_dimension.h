#pragma once

#include <memory>
#include <thread>

#include "vest_haptics/device/mailbox_device.h"

namespace vest::haptics {

/// omega, delta, sigma and lambda of Force Dimension, and the Novint Falcon, through libdhd of the maker's
/// SDK, loaded when the device is opened. Translational force only. Not tried on hardware.
///
/// Options: library (default libdhd.so.3), index (of the device, 0 …), maximum_force (N: at most this; the
/// SDK does not tell the device's own: page of the device).
class ForceDimensionDevice : public MailboxDevice {
 public:
  ForceDimensionDevice();
  ~ForceDimensionDevice() override;
  void open(const DeviceOptions& options) override;
  void close() override;
  void reset() override;

 private:
  struct Library;
  static constexpr std::uint32_t kPosition = 1, kForce = 2, kOrientation = 3;
  void serve() noexcept;
  std::string describe(std::uint32_t code) const override;

  std::unique_ptr<Library> dhd_;
  int id_ = -1;
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

}  // namespace vest::haptics
