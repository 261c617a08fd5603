#pragma once

#include <memory>
#include <thread>

#include "vest_haptics/device/mailbox_device.h"

namespace vest::haptics {

/// omega, delta, sigma and lambda of Force Dimension, and the Novint Falcon, through libdhd of the maker's
/// SDK, loaded when the device is opened. Wrist, gripper and buttons are read; force is translational. Not
/// tried on hardware.
///
/// The device's status is asked every few milliseconds. In its RESET mode it is not calibrated; where it
/// leaves the force mode by itself (its force button, a motion beyond its own limit of speed) that is a
/// latched error.
///
/// Options: library (default libdhd.so.3), index (of the device, 0 …), maximum_force (N: at most this; the
/// SDK does not tell the device's own: page of the device), shaft (axis of the maker's wrist frame that
/// points along the shaft to the tissue: -x, x, -z or z).
class ForceDimensionDevice : public MailboxDevice {
 public:
  ForceDimensionDevice();
  ~ForceDimensionDevice() override;
  void open(const DeviceOptions& options) override;
  void close() override;
  void reset() override;
  std::string calibrationHint() const override {
    return "put the calibration pole of the handle into the calibration pit until the light stops blinking";
  }

 private:
  struct Library;
  static constexpr std::uint32_t kPosition = 1, kForce = 2, kOrientation = 3, kGripper = 4, kStatus = 5,
                                 kPower = 6, kController = 7, kEnable = 8, kForcesOff = 9;
  void serve() noexcept;
  bool askStatus(std::int64_t now_ns) noexcept;
  bool readPose(Sample& sample) noexcept;
  std::string describe(std::uint32_t code) const override;

  std::unique_ptr<Library> dhd_;
  int id_ = -1;
  Eigen::Matrix3d tip_ = Eigen::Matrix3d::Identity();  ///< axes of the tip in the maker's wrist frame
  bool on_ = false;                                    ///< of the serving thread: forces were enabled
  std::int64_t since_ = 0;                             ///< ns, when
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

}  // namespace vest::haptics
