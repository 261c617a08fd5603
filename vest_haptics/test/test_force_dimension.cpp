// Protects the border to libdhd, on a stand-in that behaves as the maker's documentation says.
#include <pthread.h>

#include <chrono>
#include <functional>
#include <thread>

#include <gtest/gtest.h>

#include "device_bench.h"
#include "support.h"
#include "vest_haptics/device/force_dimension.h"

using namespace vest::haptics;
using namespace vest::haptics::testing;
using namespace std::chrono_literals;

namespace {

class ForceDimension : public ::testing::Test {
 protected:
  FakeLibrary fake{FAKE_DHD};
  ForceDimensionDevice device;
  const DeviceOptions words{{"library", FAKE_DHD}};
  Sample sample;

  void SetUp() override { fake.get<void()>("fakedhd_reset")(); }
  void TearDown() override {
    device.close();
    EXPECT_EQ(fake.get<int()>("fakedhd_violations")(), 0);
  }
  void fail(const char* what) { fake.get<void(const char*)>("fakedhd_fail")(what); }
  void mode(int reset, int power, int error) {
    fake.get<void(int, int, int)>("fakedhd_mode")(reset, power, error);
  }
  double shown() {
    double f[3];
    fake.get<void(double*)>("fakedhd_shown")(f);
    return f[2];
  }
  /// Until `done`, at most 10 s, with a loop that asks for 1 N.
  bool loop(const std::function<bool()>& done) {
    for (int i = 0; i < 10000; ++i) {
      status = device.read(sample);
      device.write({0, 0, 1.0, 0, 0});
      if (done()) return true;
      std::this_thread::sleep_for(1ms);
    }
    return false;
  }
  void press() {
    device.open(words);
    device.enableForces(true);
    ASSERT_TRUE(loop([&] { return shown() == 1.0; }));
  }
  DeviceStatus status = DeviceStatus::Starting;
};

}  // namespace

TEST_F(ForceDimension, ConformsOnItsStandIn) {
  conforms(device, words, 4);
}

TEST_F(ForceDimension, FailuresOfEachCallAreLatchedAndForcesAreZero) {
  fake.get<void(int)>("fakedhd_absent")(1);
  EXPECT_NE(refusal(device, words).find("udev"), std::string::npos);
  fake.get<void(int)>("fakedhd_absent")(0);
  fail("enable");
  EXPECT_NE(refusal(device, words).find("cannot be switched off"), std::string::npos);
  const double level[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  fake.get<void(int, const double*, int, double, unsigned)>("fakedhd_handle")(1, level, 1, 0.1, 0);
  for (const char* what : {"position", "force", "status", "frame", "gripper"}) {
    SCOPED_TRACE(what);
    press();
    fail(what);
    EXPECT_TRUE(loop([&] { return status == DeviceStatus::Error && shown() == 0.0; }));
    EXPECT_NE(device.lastError().find("cannot be"), std::string::npos) << device.lastError();
    std::this_thread::sleep_for(20ms);
    EXPECT_EQ(device.read(sample), DeviceStatus::Error) << "latched";
    device.reset();
    EXPECT_TRUE(loop([&] { return shown() == 1.0; })) << "an explicit reset brings it back";
    device.close();
  }
  device.open(words);
  ASSERT_TRUE(loop([&] { return status == DeviceStatus::Ok; }));
  fail("enable");
  device.enableForces(true);
  EXPECT_TRUE(loop([&] { return status == DeviceStatus::Error; })) << "who cannot enable says so";
  EXPECT_NE(device.lastError().find("switched on or off"), std::string::npos) << device.lastError();
}

TEST_F(ForceDimension, InResetModeThereIsNeitherPoseNorForce) {
  mode(1, 1, 0);
  device.open(words);
  device.enableForces(true);
  EXPECT_TRUE(loop([&] { return status == DeviceStatus::Uncalibrated; }));
  EXPECT_NE(device.calibrationHint().find("pole"), std::string::npos);
  for (int i = 0; i < 50; ++i) {
    loop([] { return true; });
    std::this_thread::sleep_for(1ms);
    ASSERT_EQ(shown(), 0.0);
    ASSERT_EQ(status, DeviceStatus::Uncalibrated);
  }
  mode(0, 1, 0);  // the pole was in its pit
  EXPECT_TRUE(loop([&] { return status == DeviceStatus::Ok && shown() == 1.0; }));
  mode(1, 1, 0);
  EXPECT_TRUE(loop([&] { return status == DeviceStatus::Uncalibrated && shown() == 0.0; }))
      << "asked again and again";
}

TEST_F(ForceDimension, WhereTheDeviceLeavesItsForceModeByItselfThatIsALatchedError) {
  const std::function<void()> ways[] = {
      [&] { fake.get<void()>("fakedhd_force_button")(); },
      [&] { fake.get<void(double)>("fakedhd_push")(3.0); },  // faster than its limit
      [&] { mode(0, 0, 0); },                                // power
      [&] { mode(0, 1, 1); },                                // its controller
  };
  const char* says[] = {"force button", "faster", "power", "controller"};
  for (int i = 0; i < 4; ++i) {
    SCOPED_TRACE(says[i]);
    press();
    ways[i]();
    EXPECT_TRUE(loop([&] { return status == DeviceStatus::Error; }));
    EXPECT_NE(device.lastError().find(says[i]), std::string::npos) << device.lastError();
    EXPECT_EQ(shown(), 0.0) << "nobody enables them behind the person's back";
    mode(0, 1, 0);
    device.close();
  }
}

TEST_F(ForceDimension, TheHandlesFrameBecomesZAlongTheShaftAndGripperAndButtonsAreRead) {
  // At rest the maker's frame is x to the user, y right, z up; ours is x right, y away, z up.
  const double level[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  // Turned by a quarter about its y, so that its x points down: the shaft, along -x, points up.
  const double up[9] = {0, 0, 1, 0, 1, 0, -1, 0, 0};
  const struct {
    const double* frame;
    const char* shaft;
    Eigen::Vector3d z, x;
  } cases[] = {{level, "", {0, 1, 0}, {1, 0, 0}},
               {level, "x", {0, -1, 0}, {1, 0, 0}},
               {level, "-z", {0, 0, -1}, {1, 0, 0}},
               {level, "z", {0, 0, 1}, {1, 0, 0}},
               {up, "-x", {0, 0, 1}, {1, 0, 0}}};
  for (const auto& c : cases) {
    SCOPED_TRACE(c.shaft);
    fake.get<void(int, const double*, int, double, unsigned)>("fakedhd_handle")(1, c.frame, 1, -0.3, 0x85);
    DeviceOptions options = words;
    options["shaft"] = c.shaft;
    device.open(options);
    EXPECT_TRUE(device.capabilities().orientation);
    EXPECT_TRUE(device.capabilities().jaw);
    EXPECT_EQ(device.capabilities().buttons, 8);
    ASSERT_TRUE(loop([&] { return status == DeviceStatus::Ok; }));
    EXPECT_NEAR((sample.orientation * Eigen::Vector3d::UnitZ() - c.z).norm(), 0.0, 1e-12);
    EXPECT_NEAR((sample.orientation * Eigen::Vector3d::UnitX() - c.x).norm(), 0.0, 1e-12)
        << "jaws open to the side";
    EXPECT_NEAR(sample.jaw, 0.3, 1e-12) << "left-handed grippers count the other way";
    EXPECT_EQ(sample.buttons, 0x85u);
    device.close();
  }
  DeviceOptions wrong = words;
  wrong["shaft"] = "y";
  EXPECT_NE(refusal(device, wrong).find("allowed: -x, x, -z, z"), std::string::npos);
}

TEST_F(ForceDimension, ItsThreadHasRealTimePriorityWhereThatIsAllowed) {
  int may = -1;
  std::thread([&] {
    const sched_param parameter{80};
    may = ::pthread_setschedparam(::pthread_self(), SCHED_FIFO, &parameter);
  }).join();
  press();
  EXPECT_EQ(fake.get<int()>("fakedhd_policy")(), may == 0 ? SCHED_FIFO : SCHED_OTHER);
}
