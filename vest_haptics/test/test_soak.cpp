// Protects long sessions: eight hours of ticks on an injected clock, through shared memory, with everything
// that a day brings, cost neither memory nor descriptors.
#include <sys/mman.h>
#include <unistd.h>

#include <gtest/gtest.h>

#include "../../vest_tissue/test/support/soak.h"
#include "support.h"
#include "vest_haptics/device/simulated.h"
#include "vest_haptics/loop/loop.h"

using namespace vest::haptics;
using namespace vest::haptics::testing;
using vest::control::OperatingState;

TEST(Soak, EightHoursOfTicksCostNoMemoryAndNoDescriptor) {
  const std::string name = "/vest_test_soak_" + std::to_string(::getpid());
  const std::int64_t ticks = counted(28800000, 288000, "ticks");
  SimulatedDevice device;
  DeviceOptions motion;
  motion["motion"] = "press";
  device.open(motion);
  vest::shared::ContactWriter writer(name);
  const auto reader = std::make_shared<vest::shared::ContactReader>(name);
  ASSERT_EQ(reader->connect(), "");
  Loop loop(device, options(), reader);
  HalfSpace tissue;
  loop.post(Command::Enable);
  vest::testing::Soak soak;
  std::int64_t felt = 0, faults = 0;
  bool in_fault = false;
  Eigen::Vector3d tip(0, 0, 0.06);
  for (std::int64_t i = 0; i < ticks; ++i) {
    const std::int64_t now = (1000 + i) * kMs;
    const std::int64_t minute = i % 60000;
    // Each minute of 60,000 ticks: the simulation stands still for 0.2 s, is reset, is started anew; a
    // reading is spoilt; the device fails, is reset, and forces are asked for again.
    if (minute < 20000 || minute >= 20200) writer.write(*tissue.step(tip, now));
    if (minute == 25000) writer.beginGeneration();
    if (minute == 30000) device.spoil(2, std::nan(""));
    if (minute == 30005) device.mend();
    if (minute == 40000) device.inject(DeviceStatus::Error);
    if (minute == 40100) {
      device.reset();
      loop.post(Command::Disable);
    }
    if (minute == 40200) loop.post(Command::Enable);
    if (minute == 50000) loop.servo({0.1, 0.0, 0.0}, now);
    const TickReport& report = loop.tickOnce(now);
    device.advance(0.001);
    tip = report.valid ? report.tip_W : tip;
    double force = 0;
    for (const double load : report.loads) {
      ASSERT_TRUE(std::isfinite(load)) << "tick " << i;
      force += load * load;
    }
    felt += force > 0.0;
    const bool fault = report.state == OperatingState::Fault;
    faults += fault && !in_fault;
    in_fault = fault;
    if (i >= ticks / 10 && i % (ticks / 100) == 0) soak.sample(static_cast<double>(i) / 3.6e6);
  }
  EXPECT_GT(felt, ticks / 10) << "a hand that feels something";
  EXPECT_EQ(faults, (ticks + 19999) / 60000) << "one fault a minute, and out of it again";
  soak.judge();
  ::shm_unlink(name.c_str());
}
