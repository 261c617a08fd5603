// Protects every device plug-in by one suite, and the messages where library, port or right is missing.
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <fstream>

#include <gtest/gtest.h>

#include "allocations.h"
#include "device_bench.h"
#include "vest_haptics/conformance/conformance.h"
#include "vest_haptics/device/force_dimension.h"
#include "vest_haptics/device/impulse_engine.h"
#include "vest_haptics/device/phantom.h"
#include "vest_haptics/device/replay.h"
#include "vest_haptics/device/simulated.h"

using namespace vest::haptics;
using namespace vest::haptics::testing;

void vest::haptics::testing::conforms(Device& device, const DeviceOptions& words, int attempts) {
  conformance::Options options;
  options.device = words;
  options.allocations = [] { return vest::haptics::testing::allocations; };
  // How long a call takes says nothing here: another program may hold it up.
  const auto timed = [](const auto& f) { return f.promise.find("CPU time") != std::string::npos; };
  const auto all_kept = [&](const auto& findings) {
    return std::all_of(findings.begin(), findings.end(), [&](const auto& f) { return f.kept || timed(f); });
  };
  auto findings = conformance::run(device, options);
  for (int i = 1; i < attempts && !all_kept(findings); ++i) findings = conformance::run(device, options);
  EXPECT_GE(findings.size(), 8u);
  for (const auto& f : findings) EXPECT_TRUE(f.kept || timed(f)) << f.promise << ": " << f.detail;
}

TEST(Devices, TheSimulatedDeviceConforms) {
  SimulatedDevice device;
  conforms(device, {{"motion", "circle"}});
}
TEST(Devices, TheSimulatedFiveAxisDeviceConforms) {
  SimulatedDevice device;
  conforms(device, {{"axes", "joints"}, {"motion", "press"}});
}
TEST(Devices, TheReplayDeviceConforms) {
  ReplayDevice device;
  conforms(device, {{"file", DATA "/hand.csv"}});
}

TEST(Devices, AColumnThatStandsTwiceIsRefused) {
  const std::string file = ::testing::TempDir() + "/twice.csv";
  std::ofstream(file) << "t_s,px_mm,py_mm,pz_mm,qx,qy,qz,qw,qw\n0,0,0,0,0,0,0,1,1\n1,0,0,0,0,0,0,1,1\n";
  ReplayDevice device;
  EXPECT_NE(refusal(device, {{"file", file}}).find("'qw' stands there twice"), std::string::npos);
  std::remove(file.c_str());
}

TEST(Devices, TheSimulatedWatchdogAndItsSwitchTakeTheForceAway) {
  SimulatedDevice device;
  device.open({{"watchdog", "0.02"}});
  device.enableForces(true);
  device.write({0, 0, 1.0, 0, 0});
  for (int i = 0; i < 19; ++i) device.advance(0.001);
  EXPECT_EQ(device.shown()[2], 1.0);
  for (int i = 0; i < 3; ++i) device.advance(0.001);
  EXPECT_EQ(device.shown()[2], 0.0) << "nobody renewed it for 22 ms";
  device.write({0, 0, 1.0, 0, 0});
  device.enableForces(false);
  device.advance(0.001);
  EXPECT_EQ(device.shown()[2], 0.0);
}

TEST(Devices, AMissingLibraryIsOneMessageThatSaysWhatToInstall) {
  PhantomDevice phantom;
  const std::string p = refusal(phantom, {{"library", "libNoSuchThing.so"}});
  EXPECT_NE(p.find("Install OpenHaptics"), std::string::npos) << p;
  ForceDimensionDevice dhd;
  const std::string d = refusal(dhd, {{"library", "libNoSuchThing.so"}});
  EXPECT_NE(d.find("Install the Force Dimension SDK"), std::string::npos) << d;
  // A library that is another one.
  EXPECT_NE(refusal(phantom, {{"library", FAKE_DHD}}).find("lacks the function hdInitDevice"),
            std::string::npos);
  ImpulseEngineDevice engine;
  const std::string e = refusal(engine, {{"port", "/dev/no_such_port"}});
  EXPECT_NE(e.find("dialout"), std::string::npos) << e;
  EXPECT_NE(refusal(engine, {{"port", "/dev/null"}, {"force", "/no/such.so"}}).find("not public"),
            std::string::npos);
  EXPECT_NE(
      refusal(engine, {{"port", "/dev/null"}, {"force", "emulator"}, {"force_port", "/dev/no_such_port"}})
          .find("force side: port '/dev/no_such_port'"),
      std::string::npos);
}

TEST(Devices, APortWithoutTheRightToItIsOneMessageThatSaysWhomToAsk) {
  char path[] = "/tmp/vest_no_right_XXXXXX";
  const int file = ::mkstemp(path);
  ASSERT_GE(file, 0);
  ::close(file);
  ::chmod(path, 0);
  // Root may open everything: the question is asked as nobody.
  const pid_t child = ::fork();
  if (child == 0) {
    if (::geteuid() == 0 && ::setuid(65534) != 0) ::_exit(2);
    ImpulseEngineDevice engine;
    const std::string text = refusal(engine, {{"port", path}});
    ::_exit(text.find("ask whoever runs this computer") != std::string::npos &&
                    text.find("dialout") != std::string::npos && text.find(path) != std::string::npos
                ? 0
                : 1);
  }
  int status = -1;
  ::waitpid(child, &status, 0);
  ::unlink(path);
  EXPECT_EQ(status, 0);
}
