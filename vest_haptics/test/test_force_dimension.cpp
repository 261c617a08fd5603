// Protects the border to libdhd, on a stand-in that behaves as the maker's documentation says.
#include <chrono>
#include <thread>

#include <gtest/gtest.h>

#include "device_bench.h"
#include "support.h"
#include "vest_haptics/device/force_dimension.h"

using namespace vest::haptics;
using namespace vest::haptics::testing;
using namespace std::chrono_literals;

TEST(Devices, TheForceDimensionDeviceConformsOnItsStandIn) {
  FakeLibrary fake(FAKE_DHD);
  ForceDimensionDevice device;
  conforms(device, {{"library", FAKE_DHD}});
  EXPECT_EQ(fake.get<int()>("fakedhd_violations")(), 0);
}

TEST(ForceDimension, FailuresAreLatchedAndForcesAreZero) {
  FakeLibrary fake(FAKE_DHD);
  ForceDimensionDevice device;
  const DeviceOptions words{{"library", FAKE_DHD}};
  fake.get<void(int)>("fakedhd_absent")(1);
  EXPECT_NE(refusal(device, words).find("udev"), std::string::npos);
  fake.get<void(int)>("fakedhd_absent")(0);
  for (const bool position : {true, false}) {
    device.open(words);
    std::this_thread::sleep_for(10ms);
    device.enableForces(true);
    device.write({0, 0, 1.0, 0, 0});
    std::this_thread::sleep_for(10ms);
    fake.get<void(int, int)>("fakedhd_fail")(position, !position);
    std::this_thread::sleep_for(10ms);
    device.write({0, 0, 1.0, 0, 0});
    std::this_thread::sleep_for(5ms);
    Sample s;
    EXPECT_EQ(device.read(s), DeviceStatus::Error);
    double f[3];
    fake.get<void(double*)>("fakedhd_shown")(f);
    EXPECT_EQ(f[2], 0.0);
    device.close();
  }
}
