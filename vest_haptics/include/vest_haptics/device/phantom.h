#pragma once

#include <memory>

#include "vest_haptics/device/mailbox_device.h"

namespace vest::haptics {

/// PHANToM, Geomagic Touch and 3D Systems Touch through the HD API of OpenHaptics. libHD is loaded when the
/// device is opened; nothing of it is needed to build. Workspace, forces and stiffness are read from the
/// device. Not tried on hardware.
///
/// A device whose encoders are reset by hand takes whatever posture it has for its reset posture. So its
/// servo loop does not start before a person has held it there and said so: home().
///
/// Options: library (default libHD.so), name (of the device in the maker's set-up; empty: the default
/// device).
class PhantomDevice : public MailboxDevice {
 public:
  PhantomDevice();
  ~PhantomDevice() override;
  void open(const DeviceOptions& options) override;
  void close() override;
  void reset() override;
  void home() override;
  std::string calibrationHint() const override;

 private:
  struct Library;
  static unsigned callback(void* self);
  unsigned serve() noexcept;
  std::string describe(std::uint32_t code) const override;
  void schedule();
  void start();
  void readLimits();

  std::unique_ptr<Library> hd_;
  unsigned handle_ = 0xffffffffu;
  unsigned long task_ = 0;
  std::atomic<bool> scheduled_{false};
  Eigen::Vector3d middle_ = Eigen::Vector3d::Zero();  ///< mm, maker's axes: of the usable workspace
  bool running_ = false, output_ = false, calibrated_ = false;
  int style_ = 0;
  unsigned ticks_ = 0;
};

}  // namespace vest::haptics
