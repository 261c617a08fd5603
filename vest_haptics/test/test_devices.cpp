// Protects every device plug-in by one suite, and each maker's border by a stand-in of its library or its
// wire.
#include <dlfcn.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cmath>
#include <csignal>
#include <fstream>
#include <limits>
#include <random>
#include <thread>

#include <gtest/gtest.h>

#include "allocations.h"
#include "support.h"
#include "vest_haptics/conformance/conformance.h"
#include "vest_haptics/device/force_dimension.h"
#include "vest_haptics/device/impulse_engine.h"
#include "vest_haptics/device/phantom.h"
#include "vest_haptics/device/replay.h"
#include "vest_haptics/device/simulated.h"

using namespace vest::haptics;
using namespace std::chrono_literals;

namespace {

void conforms(Device& device, const DeviceOptions& words) {
  conformance::Options options;
  options.device = words;
  options.allocations = [] { return vest::haptics::testing::allocations; };
  const auto findings = conformance::run(device, options);
  EXPECT_GE(findings.size(), 8u);
  for (const auto& f : findings) EXPECT_TRUE(f.kept) << f.promise << ": " << f.detail;
}

std::string refusal(Device& device, const DeviceOptions& words) {
  try {
    device.open(words);
  } catch (const DeviceError& e) {
    return e.what();
  }
  return "";
}

/// Functions of a stand-in library, by name.
struct FakeLibrary {
  void* handle;
  explicit FakeLibrary(const char* path) : handle(::dlopen(path, RTLD_NOW | RTLD_LOCAL)) {
    EXPECT_NE(handle, nullptr) << ::dlerror();
  }
  ~FakeLibrary() { ::dlclose(handle); }
  template <class F>
  F* get(const char* name) const {
    return reinterpret_cast<F*>(::dlsym(handle, name));
  }
};

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
TEST(Devices, TheForceDimensionDeviceConformsOnItsStandIn) {
  FakeLibrary fake(FAKE_DHD);
  ForceDimensionDevice device;
  conforms(device, {{"library", FAKE_DHD}});
  EXPECT_EQ(fake.get<int()>("fakedhd_violations")(), 0);
}
TEST_F(Phantom, ConformsOnItsStandIn) {
  conforms(device, words);
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
  std::this_thread::sleep_for(25ms);
  step(1);
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
  fake.get<void(double)>("fakehd_nominal")(std::nan(""));
  EXPECT_NE(refusal(device, words).find("nominal maximum force"), std::string::npos);
  fake.get<void(double)>("fakehd_nominal")(3.3);
  device.open(words);
}

TEST_F(Phantom, EachCalibrationStyleIsAskedForAndNoForceComesBefore) {
  const struct {
    int styles;
    const char* hint;
  } cases[] = {{1, "reset position"}, {4, "inkwell"}, {2, "reach"}};
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

namespace {

/// The mailbox alone, its serving thread played by the test.
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

TEST(Mailbox, NoForceBeyondTheMaximumIsServedWhateverTheLoopAsksFor) {
  const double odd[] = {2.01, -2.01, 1e300, std::nan(""), std::numeric_limits<double>::infinity()};
  for (const bool joints : {false, true}) {
    Served d(joints);
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

TEST(Hci, AnswersHaveTheSizeThatTheProtocolSays) {
  EXPECT_EQ(hci::answerSize(0x23), 16u) << "timer and six encoders";
  EXPECT_EQ(hci::answerSize(0x00), 2u);
  EXPECT_EQ(hci::answerSize(0x2D), 4u + 9u + 4u)
      << "eight analog channels with a byte of low bits, two encoders";
  EXPECT_EQ(hci::encodersOf(2), 3);
  EXPECT_EQ(hci::analogOf(0x08), 4);
}

TEST(Hci, AnyAnswerComesBackAsItWasAndSpoiledStreamsAreBackInStepWithinTwo) {
  std::mt19937 random(5);
  const auto count = vest::haptics::testing::counted(10000000, 100000, "answers, spoiled ones among them");
  hci::Decoder decoder(0x23);
  int good = 0, late = 0, wrong = 0, since = 100;
  for (int n = 0; n < count; ++n) {
    hci::Answer sent, got;
    sent.buttons = random() & 0x7f;
    sent.timer = random() & 0x3fff;
    for (int& e : sent.encoders) e = random() & 0x3fff;
    std::uint8_t bytes[32];
    std::size_t size = hci::encode(0x23, sent, bytes);
    const bool spoil = n % 7 == 3;
    if (spoil) {
      const std::size_t at = random() % size;
      switch (random() % 3) {
        case 0:  // lost
          for (std::size_t i = at; i + 1 < size; ++i) bytes[i] = bytes[i + 1];
          --size;
          break;
        case 1:
          bytes[at] ^= 0x80;
          break;
        default:  // cut short: unplugged and back
          size = at;
      }
    }
    bool whole = false;
    for (std::size_t i = 0; i < size; ++i) whole |= decoder.push(bytes[i], got);
    if (spoil) {
      wrong += whole;
      since = 0;
      continue;
    }
    ++since;
    if (whole && got.encoders == sent.encoders && got.timer == sent.timer && got.buttons == sent.buttons)
      ++good;
    else
      late += since > 2, wrong += whole;
  }
  EXPECT_EQ(wrong, 0) << "parts of two answers make no third";
  EXPECT_EQ(late, 0);
  EXPECT_GT(good, count * 5 / 7 - 1);
}

TEST(Hci, AnAnswerToAnotherRequestIsNoneOfOurs) {
  hci::Decoder decoder(0x23);
  hci::Answer sent, got;
  std::uint8_t bytes[32];
  const std::size_t size = hci::encode(0x2F, sent, bytes);  // with analog channels that nobody asked for
  for (std::size_t i = 0; i < size; ++i) EXPECT_FALSE(decoder.push(bytes[i], got));
  EXPECT_EQ(decoder.skipped(), size);
}

TEST(ForceFrame, OnlyWhatComesWholeIsAForceAndNoneBeyondTheMaximum) {
  const Loads maximum{0.9, 0.9, 8.0, 0.05, 0.0};
  std::uint8_t frame[force_frame::kSize];
  force_frame::encode(3, {0.3, 100.0, -1e300, 0.01, 1.0}, maximum, frame);
  std::uint8_t sequence = 0;
  Loads got{};
  ASSERT_TRUE(force_frame::decode(frame, maximum, sequence, got));
  EXPECT_EQ(sequence, 3);
  EXPECT_NEAR(got[0], 0.3, 1e-4);
  EXPECT_NEAR(got[1], 0.9, 1e-9);
  EXPECT_NEAR(got[2], -8.0, 1e-9);
  EXPECT_EQ(got[4], 0.0) << "a channel that is not there";
  EXPECT_EQ(frame[10] | frame[11], 0) << "a channel that is not there";
  for (std::size_t bit = 0; bit < 8 * force_frame::kSize; ++bit) {
    std::uint8_t spoiled[force_frame::kSize];
    std::copy(frame, frame + force_frame::kSize, spoiled);
    spoiled[bit / 8] = static_cast<std::uint8_t>(spoiled[bit / 8] ^ (1u << bit % 8));
    EXPECT_FALSE(force_frame::decode(spoiled, maximum, sequence, got)) << "bit " << bit;
  }
}

TEST(Hci, EncodersAreFollowedAcrossTheirWrap) {
  hci::Unwrap u;
  EXPECT_EQ(u.update(8192), 0);
  long wished = 0;
  int raw = 8192;
  std::mt19937 random(1);
  for (int i = 0; i < 100000; ++i) {
    const int d = static_cast<int>(random() % 8000) - 3900;
    wished += d;
    raw = (raw + d) & 16383;
    ASSERT_EQ(u.update(raw), wished);
  }
}

namespace {

/// The emulator in a process of its own.
struct Emulator {
  std::string link = "/tmp/vest_lie_" + std::to_string(::getpid()), force = link + "_force",
              log = link + ".csv";
  pid_t pid = -1;
  explicit Emulator(std::vector<std::string> more = {}) {
    std::vector<std::string> words{EMULATOR, "--link",    link, "--force-link", force, "--log",
                                   log,      "--seconds", "60"};
    words.insert(words.end(), more.begin(), more.end());
    std::vector<char*> argv;
    for (std::string& w : words) argv.push_back(w.data());
    argv.push_back(nullptr);
    pid = ::fork();
    if (pid == 0) {
      ::execv(argv[0], argv.data());
      ::_exit(127);
    }
    for (int i = 0; i < 500 && ::access(force.c_str(), F_OK) != 0; ++i) std::this_thread::sleep_for(10ms);
  }
  ~Emulator() {
    ::kill(pid, SIGTERM);
    ::waitpid(pid, nullptr, 0);
    ::unlink(log.c_str());
  }
  DeviceOptions words() const { return {{"port", link}, {"force", "emulator"}, {"force_port", force}}; }
};

}  // namespace

TEST(ImpulseEngine, ConformsOnItsEmulator) {
  Emulator emulator;
  ImpulseEngineDevice device;
  conforms(device, emulator.words());
}

TEST(ImpulseEngine, ItSaysWhoItIsAndItsHandPressesTwentyMillimetres) {
  Emulator emulator;
  ImpulseEngineDevice device;
  device.open(emulator.words());
  EXPECT_NE(device.capabilities().model.find("VEST LIE EMULATOR"), std::string::npos);
  Sample s;
  double low = 1.0, high = 0.0;
  for (int i = 0; i < 450; ++i) {
    if (device.read(s) == DeviceStatus::Ok) {
      low = std::min(low, s.joints[2]);
      high = std::max(high, s.joints[2]);
    }
    std::this_thread::sleep_for(10ms);
  }
  EXPECT_NEAR(high - low, 0.02, 0.003);
}

TEST(ImpulseEngine, LostBytesAreNoMotionAndItGoesOn) {
  Emulator emulator({"--noise", "0.01", "--motion", "rest"});
  ImpulseEngineDevice device;
  device.open(emulator.words());
  SensorCheck check(device.capabilities());
  int good = 0, fault = 0;
  for (int i = 0; i < 1000; ++i) {
    Sample s;
    if (device.read(s) == DeviceStatus::Ok) {
      const auto now = std::chrono::steady_clock::now().time_since_epoch().count();
      const auto verdict = check.check(s, now);
      good += verdict == SensorCheck::Verdict::Good;
      fault += verdict == SensorCheck::Verdict::Fault;
    }
    std::this_thread::sleep_for(1ms);
  }
  EXPECT_GT(good, 500);
  EXPECT_EQ(fault, 0);
}

TEST(ImpulseEngine, WhenTheDriverIsKilledTheEmulatorsWatchdogBringsTheForceToZero) {
  Emulator emulator({"--motion", "rest"});
  int ready[2];
  ASSERT_EQ(::pipe(ready), 0);
  const pid_t child = ::fork();
  if (child == 0) {
    ImpulseEngineDevice device;
    device.open(emulator.words());
    device.enableForces(true);
    for (int i = 0;; ++i) {
      device.write({0, 0, 2.0, 0, 0});
      if (i == 500 && ::write(ready[1], "x", 1) != 1) ::_exit(1);
      std::this_thread::sleep_for(1ms);
    }
  }
  char c;
  ASSERT_EQ(::read(ready[0], &c, 1), 1);
  ::kill(child, SIGKILL);
  ::waitpid(child, nullptr, 0);
  std::this_thread::sleep_for(300ms);
  std::ifstream log(emulator.log);
  std::string line;
  // Judged by the emulator's own milliseconds: rows with force after the last frame that came.
  int forced = 0, after = 0, rows = 0;
  while (std::getline(log, line)) {
    long long ns = 0;
    double a, b, f, c4, d;
    int frames = 0;
    if (std::sscanf(line.c_str(), "%lld,%lf,%lf,%lf,%lf,%lf,%d", &ns, &a, &b, &f, &c4, &d, &frames) != 7)
      continue;
    rows = frames > 0 ? 0 : rows + 1;
    if (frames > 0) after = 0;
    forced += f != 0.0;
    after += f != 0.0 && frames == 0;
  }
  EXPECT_GT(forced, 100) << "there was force before";
  EXPECT_GT(rows, 50) << "it went on after the last frame";
  EXPECT_LE(after, 21) << "ms of force after the last frame";
  ::close(ready[0]);
  ::close(ready[1]);
}
