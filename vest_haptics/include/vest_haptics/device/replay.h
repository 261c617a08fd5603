#pragma once

#include <vector>

#include "vest_haptics/device/device.h"

namespace vest::haptics {

/// Plays recorded hand motion: a CSV with the columns t_s, px_mm, py_mm, pz_mm, qx, qy, qz, qw (others are
/// ignored), as hand motion is recorded for vest_instruments.
///
/// Options: file; frame: `phantom` (x right, y up, z to the user, as OpenHaptics measures) or `device` (the
/// frame of device.h); loop: true or false. It shows no force; the motion is that of a hand that felt none,
/// or another one.
class ReplayDevice : public Device {
 public:
  ReplayDevice();
  void open(const DeviceOptions& options) override;
  void close() override { open_ = false; }
  const Capabilities& capabilities() const override { return capabilities_; }
  DeviceStatus read(Sample& sample) noexcept override;
  DeviceStatus write(const Loads&) noexcept override { return DeviceStatus::Ok; }
  void enableForces(bool) noexcept override {}
  void reset() override {
    time_ = 0.0;
    at_ = 0;
  }
  void advance(double dt) noexcept override { time_ += dt; }
  double duration() const { return rows_.empty() ? 0.0 : rows_.back().t; }  ///< s

 private:
  struct Row {
    double t;
    Sample sample;
  };
  Capabilities capabilities_;
  std::vector<Row> rows_;
  bool open_ = false, loop_ = false;
  double time_ = 0.0;
  std::size_t at_ = 0;
};

}  // namespace vest::haptics
