// Plug-ins as a lab may write them at first: one whose call never comes back, one whose reset() does not, one
// that throws, one whose readings turn into no numbers, one that says it can show any force. For
// test_ros_hazards.py; not installed.
#include <unistd.h>

#include <cmath>
#include <cstdlib>
#include <limits>

#include <pluginlib/class_list_macros.hpp>

#include "vest_haptics/device/device.h"
#include "vest_haptics/device/force_transport.h"

namespace vest_bad_devices {

using namespace vest::haptics;

class Good : public Device {
 public:
  Good() {
    capabilities_.model = "bad device";
    capabilities_.maximum = {3.0, 0, 0, 0, 0};
  }
  void open(const DeviceOptions& options) override {
    checkOptions("bad device", options, "");
    open_ = true;
  }
  void close() override { open_ = false; }
  const Capabilities& capabilities() const override { return capabilities_; }
  DeviceStatus read(Sample& sample) noexcept override {
    if (!open_) return DeviceStatus::Starting;
    sample.position = {0.01 * std::sin(0.003 * ++reads_), 0.0, 0.02};
    if (reads_ > 2000) spoil(sample);
    return DeviceStatus::Ok;
  }
  DeviceStatus write(const Loads&) noexcept override { return DeviceStatus::Ok; }
  void enableForces(bool) noexcept override {}
  void reset() override {}

 protected:
  virtual void spoil(Sample&) noexcept {}
  Capabilities capabilities_;
  bool open_ = false;
  int reads_ = 0;
};

class Hangs : public Good {
  void spoil(Sample&) noexcept override {
    for (;;) ::pause();
  }
};
class ResetHangs : public Good {
  void reset() override {
    for (;;) ::pause();
  }
};
class NotNumbers : public Good {
  void spoil(Sample& sample) noexcept override { sample.position.x() = std::nan(""); }
};
class Throws : public Good {
  void open(const DeviceOptions&) override { throw 42; }
};
class Boundless : public Good {
 public:
  Boundless() { capabilities_.maximum[0] = std::numeric_limits<double>::infinity(); }
};

class GoneForGood : public ForceTransport {
 public:
  void open(const std::string&, const Loads&) override {
    if (opened_++ > 0) throw 42;
  }
  void close() override {}
  bool write(const Loads&) noexcept override { return false; }
  double watchdog() const override { return 0.0; }

 private:
  int opened_ = 0;
};

}  // namespace vest_bad_devices

extern "C" vest::haptics::ForceTransport* vest_force_transport() {
  return std::getenv("VEST_BAD_TRANSPORT") ? new vest_bad_devices::GoneForGood : nullptr;
}

PLUGINLIB_EXPORT_CLASS(vest_bad_devices::Hangs, vest::haptics::Device)
PLUGINLIB_EXPORT_CLASS(vest_bad_devices::ResetHangs, vest::haptics::Device)
PLUGINLIB_EXPORT_CLASS(vest_bad_devices::NotNumbers, vest::haptics::Device)
PLUGINLIB_EXPORT_CLASS(vest_bad_devices::Throws, vest::haptics::Device)
PLUGINLIB_EXPORT_CLASS(vest_bad_devices::Boundless, vest::haptics::Device)
