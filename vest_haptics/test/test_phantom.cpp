// Protects the border to OpenHaptics, on a stand-in of libHD that behaves as the maker's pages say.
#include <chrono>
#include <cmath>
#include <thread>

#include <gtest/gtest.h>

#include "device_bench.h"
#include "support.h"
#include "vest_haptics/device/phantom.h"

using namespace vest::haptics;
using namespace vest::haptics::testing;
using namespace std::chrono_literals;

namespace {

class Phantom : public ::testing::Test {
 protected:
  FakeLibrary fake{FAKE_HD};
  PhantomDevice device;
  const DeviceOptions words{{"library", FAKE_HD}};
  void SetUp() override { fake.get<void()>("fakehd_reset")(); }
  void TearDown() override {
    device.close();
    EXPECT_EQ(fake.get<int()>("fakehd_violations")(), 0) << fake.get<const char*()>("fakehd_violation")();
  }
  void manual() { fake.get<void()>("fakehd_manual")(); }
  void step(int n) { fake.get<void(int)>("fakehd_step")(n); }
  std::array<double, 3> shown() {
    std::array<double, 3> f{};
    fake.get<void(double*)>("fakehd_shown")(f.data());
    return f;
  }
};

}  // namespace

TEST_F(Phantom, ConformsOnItsStandIn) {
  conforms(device, words, 4);
}

TEST_F(Phantom, ADeviceThatIsNotThereIsOneMessageWithTheMakersWords) {
  const std::string text = refusal(device, {{"library", FAKE_HD}, {"name", "missing"}});
  EXPECT_NE(text.find("'missing'"), std::string::npos) << text;
  EXPECT_NE(text.find("0x300"), std::string::npos) << text;
}

TEST_F(Phantom, PositionAndForceAreTurnedBetweenTheMakersAxesAndOurs) {
  manual();
  device.open(words);
  fake.get<void(double, double, double)>("fakehd_wish")(0.01, 0.02, 0.03);
  step(3000);
  Sample s;
  ASSERT_EQ(device.read(s), DeviceStatus::Ok);
  EXPECT_NEAR(s.position.x(), 0.01, 1e-4) << "right";
  EXPECT_NEAR(s.position.y(), -0.03, 1e-4) << "their z points to the user, our y away";
  EXPECT_NEAR(s.position.z(), 0.02, 1e-4) << "up";
  const Eigen::Vector3d shaft = s.orientation * Eigen::Vector3d::UnitZ();
  EXPECT_NEAR(shaft.z(), -1.0, 1e-6) << "the stylus of the stand-in points straight down";
  device.enableForces(true);
  device.write({0.1, 0.2, 0.3, 0, 0});
  step(2);
  EXPECT_NEAR(shown()[0], 0.1, 1e-12);
  EXPECT_NEAR(shown()[1], 0.3, 1e-12);
  EXPECT_NEAR(shown()[2], -0.2, 1e-12);
}

TEST_F(Phantom, AForceThatIsNotRenewedIsZeroAfterTwentyMilliseconds) {
  manual();
  device.open(words);
  step(2);
  device.enableForces(true);
  device.write({0, 0, 1.0, 0, 0});
  step(2);
  ASSERT_NEAR(shown()[1], 1.0, 1e-12);
  for (int i = 0; i < 25; ++i) {
    std::this_thread::sleep_for(1ms);
    step(1);  // poses go on
  }
  EXPECT_EQ(shown()[1], 0.0) << "the loop has died";
}

TEST_F(Phantom, EachErrorAtEachCallIsZeroForceAndLatched) {
  const char* calls[] = {"hdMakeCurrentDevice", "hdBeginFrame", "hdGetDoublev",      "hdGetIntegerv",
                         "hdSetDoublev",        "hdEndFrame",   "hdCheckCalibration"};
  const unsigned codes[] = {0x100, 0x200, 0x201, 0x202, 0x203, 0x204, 0x205, 0x300, 0x301, 0x302, 0x303};
  manual();
  for (const char* call : calls) {
    for (const unsigned code : codes) {
      device.open(words);
      step(5);
      device.enableForces(true);
      device.write({0, 0, 1.0, 0, 0});
      step(3);
      ASSERT_NEAR(shown()[1], 1.0, 1e-12);
      fake.get<void(const char*, unsigned, int)>("fakehd_fail")(call, code, 0);
      step(std::string(call) == "hdCheckCalibration" ? 101 : 1);
      Sample s;
      EXPECT_EQ(device.read(s), DeviceStatus::Error) << call << " 0x" << std::hex << code;
      EXPECT_EQ(device.errorCode(), code) << call;
      EXPECT_EQ(shown()[1], 0.0) << call;
      EXPECT_EQ(fake.get<int()>("fakehd_output")(), 0) << "force output is off after " << call;
      EXPECT_FALSE(device.lastError().empty());
      EXPECT_EQ(device.write({0, 0, 1.0, 0, 0}), DeviceStatus::Error);
      step(3);
      EXPECT_EQ(shown()[1], 0.0) << "latched";
      device.reset();
      step(3);
      EXPECT_EQ(device.read(s), DeviceStatus::Ok) << "an explicit reset brings it back";
      device.close();
    }
  }
}

TEST_F(Phantom, AnErrorWhileOpeningIsAMessageAndNothingStaysBehind) {
  for (const char* call :
       {"hdInitDevice", "hdGetDoublev", "hdGetIntegerv", "hdScheduleAsynchronous", "hdStartScheduler"}) {
    fake.get<void(const char*, unsigned, int)>("fakehd_fail")(call, 0x302, 0);
    EXPECT_NE(refusal(device, words).find("0x302"), std::string::npos) << call;
  }
  device.open(words);
}

TEST_F(Phantom, ForcesStiffnessAndWorkspaceAreTheDevicesOwn) {
  const auto limits = fake.get<void(double, double, double, double)>("fakehd_limits");
  manual();
  limits(7.9, 1.75, 2.3, 260.0);  // N, N, N/mm, mm
  device.open(words);
  const Capabilities& c = device.capabilities();
  EXPECT_EQ(c.maximum[0], 7.9);
  EXPECT_EQ(c.continuous, 1.75);
  EXPECT_NEAR(c.stiffness, 2300.0, 1e-9);
  EXPECT_NEAR(c.workspace[0], 0.130, 1e-12) << "half of its width";
  EXPECT_NEAR(c.workspace[1], 0.035, 1e-12) << "our y is their z";
  EXPECT_NEAR(c.workspace[2], 0.060, 1e-12);
  step(2);
  Sample s;
  ASSERT_EQ(device.read(s), DeviceStatus::Ok);
  EXPECT_NEAR(s.position.x(), -0.050, 1e-9) << "the middle of the workspace is our origin";
  device.close();
  const double nan = std::nan("");
  const struct {
    double nominal, continuous, stiffness, width;
    const char* says;
  } odd[] = {{nan, 0.9, 0.5, 160, "nominal maximum force"},   {100, 0.9, 0.5, 160, "nominal maximum force"},
             {3.3, -1, 0.5, 160, "maximum continuous force"}, {3.3, 0.9, 0, 160, "maximum stiffness"},
             {3.3, 0.9, 0.5, nan, "usable workspace"},        {3.3, 0.9, 0.5, -1, "usable workspace"}};
  for (const auto& o : odd) {
    limits(o.nominal, o.continuous, o.stiffness, o.width);
    EXPECT_NE(refusal(device, words).find(o.says), std::string::npos) << o.says;
  }
}

// The posture that a device has while its encoders are reset is taken for its reset posture: a wrong one
// shows forces where there is nothing.
TEST_F(Phantom, EncodersAreResetOnlyWhereAPersonSaysSoAndBeforeTheServoLoopRuns) {
  const auto started = [&] { return fake.get<int()>("fakehd_started")(); };
  fake.get<void(unsigned, int)>("fakehd_calibration")(0x5001, 1);
  fake.get<void(double, double, double)>("fakehd_hold")(0.05, 0.0, 0.0);  // somewhere
  manual();
  device.open(words);
  device.enableForces(true);
  Sample s;
  for (int i = 0; i < 10; ++i) {
    device.write({0, 0, 1.0, 0, 0});
    step(1);
    EXPECT_EQ(device.read(s), DeviceStatus::Uncalibrated);
    EXPECT_EQ(fake.get<int(const char*)>("fakehd_calls")("hdUpdateCalibration"), 0) << "not by itself";
    EXPECT_FALSE(started());
  }
  EXPECT_NE(device.calibrationHint().find("reset position"), std::string::npos);
  fake.get<void(double, double, double)>("fakehd_hold")(0.0, 0.0, 0.0);  // the reset posture
  device.home();
  EXPECT_TRUE(started());
  step(2);
  ASSERT_EQ(device.read(s), DeviceStatus::Ok);
  EXPECT_NEAR(s.position.x(), 0.0, 1e-9);
  device.write({0, 0, 1.0, 0, 0});
  step(1);
  EXPECT_NEAR(shown()[1], 1.0, 1e-12);
  // What the library says later does not make it take any posture for that one.
  device.enableForces(false);
  step(1);
  fake.get<void(unsigned, int)>("fakehd_calibration")(0x5001, 1);
  step(101);
  EXPECT_EQ(device.read(s), DeviceStatus::Uncalibrated);
  EXPECT_EQ(shown()[1], 0.0);
  EXPECT_EQ(fake.get<int(const char*)>("fakehd_calls")("hdUpdateCalibration"), 1);
  device.home();
  step(2);
  EXPECT_EQ(device.read(s), DeviceStatus::Ok) << "a second time, too";
  device.close();
  fake.get<void(unsigned, int)>("fakehd_calibration")(0x5001, 1);
  device.open(words);
  fake.get<void(const char*, unsigned, int)>("fakehd_fail")("hdUpdateCalibration", 0x300, 0);
  device.home();
  EXPECT_FALSE(started()) << "a reset that failed is none";
  EXPECT_EQ(device.read(s), DeviceStatus::Error) << "and is said";
  EXPECT_EQ(device.errorCode(), 0x300u);
  device.reset();
  EXPECT_EQ(device.read(s), DeviceStatus::Uncalibrated) << "the person tries again";
  device.home();
  step(2);
  EXPECT_EQ(device.read(s), DeviceStatus::Ok);
  device.close();
  // Others calibrate themselves: home() is nothing to them.
  fake.get<void(unsigned, int)>("fakehd_calibration")(0x5000, 2);
  device.open(words);
  device.home();
  step(2);
  EXPECT_EQ(device.read(s), DeviceStatus::Ok);
}

// Nobody refreshes a force while the servo loop stands still.
TEST_F(Phantom, WhoResetsEncodersWhileForceIsShownIsShownNoneFromThenOn) {
  fake.get<void(unsigned, int)>("fakehd_calibration")(0x5000, 1);
  manual();
  for (const bool fails : {false, true}) {
    device.open(words);
    device.home();
    step(2);
    device.enableForces(true);
    device.write({0, 0, 1.0, 0, 0});
    step(1);
    ASSERT_NEAR(shown()[1], 1.0, 1e-12);
    if (fails) fake.get<void(const char*, unsigned, int)>("fakehd_fail")("hdUpdateCalibration", 0x300, 0);
    device.home();
    EXPECT_EQ(fake.get<int()>("fakehd_output")(), 0) << "force output is off, fails: " << fails;
    EXPECT_EQ(shown()[1], 0.0);
    device.close();
  }
}

TEST_F(Phantom, AResetWithinTheLastLinesOfTheErrorsCallbackIsNotLost) {
  struct Other {
    PhantomDevice& device;
    std::thread thread;
  } other{device, {}};
  manual();
  device.open(words);
  step(3);
  fake.get<void(const char*, unsigned, int)>("fakehd_fail")("hdGetDoublev", 0x302, 0);
  // The last call of the callback before it ends itself.
  fake.get<void(const char*, void (*)(void*), void*)>("fakehd_hook")(
      "hdDisable",
      [](void* user) {
        Other& o = *static_cast<Other*>(user);
        o.thread = std::thread([&o] { o.device.reset(); });
        std::this_thread::sleep_for(50ms);
      },
      &other);
  step(1);
  ASSERT_TRUE(other.thread.joinable());
  other.thread.join();
  step(3);
  Sample s;
  EXPECT_EQ(device.read(s), DeviceStatus::Ok);
}

TEST_F(Phantom, EachCalibrationStyleIsAskedForAndNoForceComesBefore) {
  const struct {
    int styles;
    const char* hint;
  } cases[] = {{4, "inkwell"}, {2, "reach"}};
  manual();
  for (const auto& c : cases) {
    fake.get<void(unsigned, int)>("fakehd_calibration")(0x5002, c.styles);
    device.open(words);
    device.enableForces(true);
    device.write({0, 0, 1.0, 0, 0});
    step(5);
    Sample s;
    EXPECT_EQ(device.read(s), DeviceStatus::Uncalibrated);
    EXPECT_NE(device.calibrationHint().find(c.hint), std::string::npos) << device.calibrationHint();
    EXPECT_EQ(shown()[1], 0.0);
    fake.get<void(unsigned, int)>("fakehd_calibration")(0x5001, c.styles);  // sits in the inkwell now
    step(5);
    device.write({0, 0, 1.0, 0, 0});
    step(2);
    EXPECT_EQ(device.read(s), DeviceStatus::Ok);
    EXPECT_NEAR(shown()[1], 1.0, 1e-12);
    device.close();
  }
}

TEST_F(Phantom, AForceBeyondTheMaximumNeverLeavesEvenIfTheLoopFails) {
  manual();
  device.open(words);
  step(2);
  device.enableForces(true);
  for (const double bad : {3.4, 1e9, std::nan("")}) {
    device.write({0, 0, bad, 0, 0});
    step(1);
    EXPECT_EQ(shown()[1], 0.0) << bad;
  }
}
