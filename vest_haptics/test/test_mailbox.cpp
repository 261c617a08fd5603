// Protects what stands between any maker's thread and the loop: age, maximum, poses, the measured delay.
#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "device_bench.h"
#include "support.h"
#include "vest_haptics/device/mailbox_device.h"

using namespace vest::haptics;
using namespace vest::haptics::testing;
using namespace std::chrono_literals;

namespace {

/// The mailbox alone, its serving thread played by the test: a device that is well.
struct Served : MailboxDevice {
  explicit Served(bool joints = false) {
    capabilities_.joints = joints;
    capabilities_.maximum = {2.0, 2.0, 2.0, 0.5, 0.5};
    begin();
  }
  void open(const DeviceOptions&) override {}
  void close() override {}
  void reset() override { clearError(); }
  std::string describe(std::uint32_t code) const override { return "code " + std::to_string(code); }
  using MailboxDevice::deliver;
  using MailboxDevice::fail;
  using MailboxDevice::setStatus;
  using MailboxDevice::steadyNow;
  using MailboxDevice::wanted;
};

}  // namespace

TEST(Mailbox, ReadingsThatStopComingMeanUnplugged) {
  Served d;
  Sample s;
  EXPECT_EQ(d.read(s), DeviceStatus::Starting);
  d.deliver(s, Served::steadyNow());
  EXPECT_EQ(d.read(s), DeviceStatus::Starting) << "the device has not said that it is well";
  d.setStatus(DeviceStatus::Ok);
  EXPECT_EQ(d.read(s), DeviceStatus::Ok);
  d.deliver(s, Served::steadyNow() - 21 * vest::haptics::testing::kMs);
  EXPECT_EQ(d.read(s), DeviceStatus::Unplugged);
}

TEST(Mailbox, TheFirstErrorIsTheCauseAndAnyErrorIsLatched) {
  Served d;
  EXPECT_EQ(d.lastError(), "");
  d.fail(0);
  EXPECT_NE(d.errorCode(), 0u) << "an error without a number is an error";
  d.reset();
  d.fail(7);
  d.fail(8);
  EXPECT_EQ(d.lastError(), "code 7");
  EXPECT_EQ(d.write(Loads{}), DeviceStatus::Error);
}

TEST(Mailbox, WithoutAPoseOfTheLastTenMillisecondsThereIsNoForce) {
  Served d;
  const Loads loads{0.4, 0, 0, 0, 0};
  d.enableForces(true);
  d.setStatus(DeviceStatus::Ok);
  d.write(loads);
  const std::int64_t now = Served::steadyNow();
  EXPECT_EQ(d.wanted(now), Loads{}) << "no pose yet";
  d.deliver(Sample{}, now);
  EXPECT_EQ(d.wanted(now + 10 * vest::haptics::testing::kMs), loads);
  EXPECT_EQ(d.wanted(now + 11 * vest::haptics::testing::kMs), Loads{});
  for (const auto status : {DeviceStatus::Unplugged, DeviceStatus::Uncalibrated, DeviceStatus::Starting}) {
    d.setStatus(status);
    EXPECT_EQ(d.wanted(now), Loads{}) << statusName(status) << ": at once, however young the pose is";
  }
}

TEST(Mailbox, TheTrueDelayAndRateAreMeasuredFromThePoseToItsForce) {
  using vest::haptics::testing::kMs;
  Served d;
  d.setStatus(DeviceStatus::Ok);
  EXPECT_EQ(d.timing().period, 0.0) << "not measured";
  Sample s;
  std::int64_t t = Served::steadyNow();
  // A pose every 1.4 ms, its force 1.9 ms later; the serving thread looks twice as often as poses come.
  const auto turns = [&](int n) {
    for (int i = 0; i < n; ++i, t += 14 * kMs / 10) {
      d.deliver(s, t);
      ASSERT_EQ(d.read(s), DeviceStatus::Ok);
      d.write(Loads{});
      d.wanted(t + 19 * kMs / 10);
      d.wanted(t + 26 * kMs / 10);
    }
  };
  turns(4);
  EXPECT_NEAR(d.timing().period, 1.4e-3, 1e-9);
  EXPECT_NEAR(d.timing().delay, 1.9e-3, 1e-9);
  t += 1000 * kMs;
  turns(2);
  EXPECT_NEAR(d.timing().period, 1.4e-3, 1e-9) << "a pause is no rate";
}

TEST(Mailbox, NoForceBeyondTheMaximumIsServedWhateverTheLoopAsksFor) {
  const double odd[] = {2.01, -2.01, 1e300, std::nan(""), std::numeric_limits<double>::infinity()};
  for (const bool joints : {false, true}) {
    Served d(joints);
    d.setStatus(DeviceStatus::Ok);
    d.deliver(Sample{}, INT64_MAX / 2);  // never old
    d.write({0.4, 0, 0, 0, 0});
    EXPECT_EQ(d.wanted(Served::steadyNow()), Loads{}) << "forces are off";
    d.enableForces(true);
    for (std::size_t channel = 0; channel < (joints ? 5u : 3u); ++channel) {
      for (const double value : odd) {
        Loads loads{};
        loads[channel] = value;
        d.write(loads);
        EXPECT_EQ(d.wanted(Served::steadyNow()), Loads{}) << joints << channel << ' ' << value;
      }
      Loads most{};
      most[channel] = d.capabilities().maximum[joints ? channel : 0];
      d.write(most);
      EXPECT_EQ(d.wanted(Served::steadyNow()), most) << joints << channel;
    }
    d.write({1.5, 1.5, 0, 0, 0});
    EXPECT_EQ(d.wanted(Served::steadyNow()) == Loads{}, !joints) << "a point has one maximum of its length";
  }
}
