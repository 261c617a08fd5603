// Protects the border to the Impulse Engine: the position protocol byte by byte, the force frames, and both
// lines against an emulator in a process of its own.
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <fstream>
#include <random>
#include <thread>

#include <gtest/gtest.h>

#include "device_bench.h"
#include "support.h"
#include "vest_haptics/device/impulse_engine.h"
#include "vest_haptics/device/sensor_check.h"

using namespace vest::haptics;
using namespace vest::haptics::testing;
using namespace std::chrono_literals;

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

TEST(ImpulseEngine, CountsAndHomeAreFiveNumbersAndNotSix) {
  for (const char* key : {"counts", "home"}) {
    for (const char* text : {"1 2 3 4", "1 2 3 4 5 6", "[1, 2, 3, 4, 5, 6]", "1 2 3 4 5 m", "1 2 3 4 nan"}) {
      ImpulseEngineDevice device;
      try {
        device.open({{"port", "/nowhere"}, {key, text}});
        FAIL() << key << " = " << text;
      } catch (const DeviceError& e) {
        EXPECT_EQ(std::string(e.what()), "Impulse Engine: option '" + std::string(key) + "' = '" + text +
                                             "'; allowed: five numbers");
      }
    }
  }
}

TEST(ImpulseEngine, ATransportOfALabThatIsNoneOrThrowsIsTold) {
  ImpulseEngineDevice device;
  try {
    device.open({{"port", "/nowhere"}, {"force", BAD_DEVICES}});
    FAIL() << "forces that nobody shows";
  } catch (const DeviceError& e) {
    EXPECT_NE(std::string(e.what()).find("gave none"), std::string::npos) << e.what();
  }
  ::setenv("VEST_BAD_TRANSPORT", "gone", 1);
  Emulator emulator;
  DeviceOptions words = emulator.words();
  words["force"] = BAD_DEVICES;
  device.open(words);
  ::unsetenv("VEST_BAD_TRANSPORT");
  DeviceStatus status = DeviceStatus::Ok;
  Sample s;
  for (int i = 0; i < 1000; ++i) {  // several looks at the line
    status = device.read(s);
    std::this_thread::sleep_for(1ms);
  }
  EXPECT_EQ(status, DeviceStatus::Error);
  EXPECT_NE(device.lastError().find("force side"), std::string::npos) << device.lastError();
}

TEST(ImpulseEngine, ConformsOnItsEmulator) {
  Emulator emulator;
  ImpulseEngineDevice device;
  conforms(device, emulator.words(), 4);
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
  const auto limit = std::chrono::steady_clock::now() + 60s;  // of patience: a busy machine reads late
  while (good < 500 && std::chrono::steady_clock::now() < limit) {
    Sample s;
    if (device.read(s) == DeviceStatus::Ok) {
      const auto now = std::chrono::steady_clock::now().time_since_epoch().count();
      const auto verdict = check.check(s, now);
      good += verdict == SensorCheck::Verdict::Good;
      fault += verdict == SensorCheck::Verdict::Fault;
    }
    std::this_thread::sleep_for(1ms);
  }
  EXPECT_EQ(good, 500);
  EXPECT_EQ(fault, 0);
}

namespace {

/// What the emulator's log says of a driver, by the emulator's own milliseconds.
struct Driven {
  int forced = 0;  ///< rows with force
  int after = 0;   ///< rows with force after the last frame that came
  int rows = 0;    ///< rows after that frame
};

Driven driven(const std::string& file) {
  Driven d;
  std::ifstream log(file);
  std::string line;
  while (std::getline(log, line)) {
    long long ns = 0;
    double a, b, force, c, e;
    int frames = 0;
    if (std::sscanf(line.c_str(), "%lld,%lf,%lf,%lf,%lf,%lf,%d", &ns, &a, &b, &force, &c, &e, &frames) != 7)
      continue;
    d.rows = frames > 0 ? 0 : d.rows + 1;
    if (frames > 0) d.after = 0;
    d.forced += force != 0.0;
    d.after += force != 0.0 && frames == 0;
  }
  return d;
}

}  // namespace

TEST(ImpulseEngine, WhenTheDriverIsKilledTheEmulatorsWatchdogBringsTheForceToZero) {
  Emulator emulator({"--motion", "rest"});
  const pid_t child = ::fork();
  if (child == 0) {
    ImpulseEngineDevice device;
    device.open(emulator.words());
    device.enableForces(true);
    for (;;) {
      device.write({0, 0, 2.0, 0, 0});
      std::this_thread::sleep_for(1ms);
    }
  }
  const auto limit = std::chrono::steady_clock::now() + 60s;  // of patience: a busy machine is late
  const auto wait = [&](auto done) {
    Driven d;
    do {
      std::this_thread::sleep_for(50ms);
      d = driven(emulator.log);
    } while (!done(d) && std::chrono::steady_clock::now() < limit);
    return d;
  };
  const Driven before = wait([](const Driven& d) { return d.forced > 100; });
  ::kill(child, SIGKILL);
  ::waitpid(child, nullptr, 0);
  const Driven d = wait([](const Driven& now) { return now.rows > 50; });
  EXPECT_GT(before.forced, 100) << "there was force before";
  EXPECT_GT(d.rows, 50) << "it went on after the last frame";
  EXPECT_LE(d.after, 21) << "ms of force after the last frame";
}

namespace {

/// What the emulator's log says of the time since the position line is dead.
struct SinceDead {
  int before = 0;    ///< rows with force while the line was there
  int forced = 0;    ///< force frames in rows with force
  int zero = 0;      ///< force frames in rows without
  bool now = false;  ///< force in the newest row
};
SinceDead sinceDead(const std::string& path) {
  SinceDead out;
  std::ifstream log(path);
  std::string line;
  while (std::getline(log, line)) {
    long long ns = 0;
    double a, b, f, c, d;
    int frames = 0, there = 0;
    if (std::sscanf(line.c_str(), "%lld,%lf,%lf,%lf,%lf,%lf,%d,%d", &ns, &a, &b, &f, &c, &d, &frames,
                    &there) != 8)
      continue;
    out.now = f != 0.0;
    if (there != 0)
      out.before += out.now;
    else
      (out.now ? out.forced : out.zero) += frames;
  }
  return out;
}

}  // namespace

// Two lines lead to this device, and its force side need not have a watchdog.
TEST(ImpulseEngine, WhenThePositionLineAloneDiesZeroGoesOutAndKeepsGoingOut) {
  for (const int how : {SIGUSR1, SIGUSR2}) {
    SCOPED_TRACE(how == SIGUSR1 ? "pulled out" : "silent");
    Emulator emulator({"--motion", "rest", "--watchdog", "0"});
    ImpulseEngineDevice device;
    device.open(emulator.words());
    device.enableForces(true);
    const auto press = [&](int ms) {
      for (int i = 0; i < ms; ++i) {
        Sample s;
        device.read(s);
        device.write({0, 0, 2.0, 0, 0});  // a loop that has not noticed anything
        std::this_thread::sleep_for(1ms);
      }
    };
    for (int i = 0; i < 100 && sinceDead(emulator.log).before < 100; ++i) press(50);
    ASSERT_GE(sinceDead(emulator.log).before, 100) << "there was force before";
    ::kill(emulator.pid, how);
    for (int i = 0; i < 60 && sinceDead(emulator.log).zero < 500; ++i) press(50);
    const SinceDead seen = sinceDead(emulator.log);
    // Judged by frames, a thousand a second: 5 ms without an answer, 10 ms that a pose lives, and those on
    // the way.
    EXPECT_LE(seen.forced, 30) << "frames of force after the line died";
    EXPECT_GE(seen.zero, 500) << "zero keeps going out";
    EXPECT_FALSE(seen.now);
    Sample s;
    EXPECT_EQ(device.read(s), DeviceStatus::Unplugged);
  }
}

// Without a watchdog the motors hold what came last, until somebody says zero.
TEST(ImpulseEngine, WhenTheForceLineAloneDiesThatIsToldAndZeroGoesOutAsSoonAsItIsBack) {
  Emulator emulator({"--motion", "rest", "--watchdog", "0"});
  ImpulseEngineDevice device;
  device.open(emulator.words());
  device.enableForces(true);
  Sample s;
  DeviceStatus status = DeviceStatus::Starting;
  // Until `done`, with a loop that asks for force all the time; at most a minute, of patience.
  const auto press = [&](auto done) {
    bool is = false;
    for (int i = 0; i < 1200 && !is; ++i) {
      for (int ms = 0; ms < 50; ++ms) {
        status = device.read(s);
        device.write({0, 0, 2.0, 0, 0});
        std::this_thread::sleep_for(1ms);
      }
      is = done();
    }
    return is;
  };
  std::streamoff since = 0;  // place in the log
  const auto fromNowOn = [&] { since = std::ifstream(emulator.log, std::ios::ate).tellg(); };
  const auto frames = [&](bool forced) {  // that came since then
    std::ifstream log(emulator.log);
    log.seekg(since);
    std::string line;
    int out = 0;
    while (std::getline(log, line)) {
      long long ns = 0;
      double a, b, f, c, e;
      int came = 0;
      if (std::sscanf(line.c_str(), "%lld,%lf,%lf,%lf,%lf,%lf,%d", &ns, &a, &b, &f, &c, &e, &came) == 7 &&
          (f != 0.0) == forced)
        out += came;
    }
    return out;
  };
  ASSERT_TRUE(press([&] { return frames(true) > 100; })) << "there was force before";
  ::kill(emulator.pid, SIGHUP);
  ASSERT_TRUE(press([&] { return status == DeviceStatus::Error; }));
  EXPECT_NE(device.lastError().find("force side"), std::string::npos) << device.lastError();
  device.reset();
  EXPECT_TRUE(press([&] { return status == DeviceStatus::Error; })) << "it is out still";
  fromNowOn();
  ::kill(emulator.pid, SIGHUP);
  EXPECT_TRUE(press([&] { return frames(false) > 100; })) << "zero, though nobody has acknowledged the error";
  EXPECT_EQ(frames(true), 0);
  EXPECT_EQ(status, DeviceStatus::Error) << "latched";
  fromNowOn();
  device.reset();
  EXPECT_TRUE(press([&] { return frames(true) > 100; })) << "an explicit reset brings it back";
}
