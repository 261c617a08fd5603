// Protects a patient's image at every maker's device: what the World asks for reaches the hand through the
// device's plug-in as through the simulated device. Clock and delay are the trial's own, so that a busy
// machine changes nothing that is judged; forces are compared where the hand rests.
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cmath>
#include <csignal>
#include <fstream>
#include <functional>
#include <thread>

#include <gtest/gtest.h>

#include "device_bench.h"
#include "vest_haptics/device/force_dimension.h"
#include "vest_haptics/device/impulse_engine.h"
#include "vest_haptics/device/phantom.h"
#include "voxel_bench.h"

using namespace vest;
using namespace vest::haptics;
using namespace vest::haptics::testing;
using namespace std::chrono_literals;

namespace {

constexpr int kPatience = 60000;  // ms: of a busy machine

/// A plug-in with the hand behind its stand-in. A tick lasts until the stand-in has served it.
struct Served : Device {
  Device& plugin;
  std::function<void()> serve;       ///< some turns of the stand-in's servo loop, at least 1 ms of it
  std::function<double()> shown;     ///< N, up or along the shaft: what the stand-in received
  std::function<void(double)> wish;  ///< m: of the hand, the same axis
  double exact = 1e-9;               ///< N, what the wire may lose
  Loads last{};
  bool lost = false;  ///< a force never came

  Served(Device& d) : plugin(d) {}
  void open(const DeviceOptions& o) override { plugin.open(o); }
  void close() override { plugin.close(); }
  const Capabilities& capabilities() const override { return plugin.capabilities(); }
  DeviceStatus read(Sample& s) noexcept override {
    DeviceStatus status = plugin.read(s);
    for (int i = 0; i < kPatience && status != DeviceStatus::Ok && !lost; ++i) {
      serve();
      status = plugin.read(s);
    }
    return status;
  }
  DeviceStatus write(const Loads& loads) noexcept override { return plugin.write(last = loads); }
  void enableForces(bool on) noexcept override { plugin.enableForces(on); }
  void reset() override { plugin.reset(); }
  void advance(double) noexcept override {
    serve();
    for (int i = 0; !lost && !(std::abs(shown() - last[2]) <= exact); ++i) {
      lost = i == kPatience;
      plugin.write(last);  // what is older than 20 ms is not shown
      serve();
    }
  }
  Timing timing() const noexcept override { return {0.001, 0.0}; }
  std::string lastError() const override { return plugin.lastError(); }
};

/// A hand above the block that goes down, rests, and comes back. Forces at rest.
struct Visit {
  double air = 0, tissue = 0, back = 0, depth = 0;
  int punctured = 0;
};
Visit visit(Device& device, const std::function<void(double)>& wish, const std::function<double()>& shown,
            tools::ToolKind tool, double reach, double stiffness, double down) {
  scene::World world(block(stiffness));
  ControllerOptions options;
  options.arm = vest::haptics::testing::arm();
  options.arm.aim_B.z() = kSurface + 0.010 + reach;
  Trial trial(world, tool, device, options);
  Visit v;
  std::int64_t now = 0;
  const auto tick = [&] {
    v.depth = kSurface + reach - trial.tick(now += kMs, 0.0).tip.z();
    for (const scene::Event& e : trial.step().events)
      v.punctured += e.kind == scene::EventKind::Punctured && e.object == 0;
  };
  // Without a jolt at either end, so that no hand swings past where it rests.
  const auto go = [&](double from, double to) {
    for (int i = 1; i <= 3000; ++i) {
      wish(from + (to - from) * 0.5 * (1 - std::cos(M_PI * std::min(1.0, i / 2000.0))));
      tick();
    }
  };
  wish(0);
  for (int i = 0; i < 2200; ++i) tick();
  v.air = shown();
  go(0, -down);
  v.tissue = shown();
  const double depth = v.depth;
  go(-down, 0);
  v.back = shown();
  v.depth = depth;
  return v;
}

Visit simulated(const DeviceOptions& options, tools::ToolKind tool, double reach, double stiffness,
                double down) {
  SimulatedDevice device;
  device.open(options);
  return visit(
      device, [&](double z) { device.wish(2, z); }, [&] { return device.shown()[2]; }, tool, reach, stiffness,
      down);
}

/// A needle, and probes in three elasticities, through a plug-in and through the simulated device, which has
/// the same limits. The forces may differ by what a hand goes within a tick at a stroke's mean speed.
/// @param late s: the age to which this stand-in's clock may let a pose grow. It tells where a needle, which
/// sticks, comes to rest; a probe forgets its way
void feelsTheSame(Device& plugin, const DeviceOptions& words, const DeviceOptions& limits,
                  const std::function<void(Served&)>& bind, const std::function<void()>& fresh, double late) {
  const struct {
    tools::ToolKind tool;
    double reach, stiffness, down;
  } cases[] = {{tools::ToolKind::InjectionNeedle, kReach, 64, 0.028},
               {tools::ToolKind::Grasper, 0, 40, 0.016},
               {tools::ToolKind::Grasper, 0, 64, 0.016},
               {tools::ToolKind::Grasper, 0, 160, 0.016}};
  for (const auto& c : cases) {
    SCOPED_TRACE(std::string(tools::toolName(c.tool)) + " " + std::to_string(c.stiffness));
    const Visit want = simulated(limits, c.tool, c.reach, c.stiffness, c.down);
    fresh();
    plugin.open(words);
    Served served(plugin);
    bind(served);
    const Visit got = visit(served, served.wish, served.shown, c.tool, c.reach, c.stiffness, c.down);
    EXPECT_FALSE(served.lost) << "a force that the stand-in never received: " << plugin.lastError();
    plugin.close();
    std::printf("%s %g N/m: %.6f N, simulated %.6f N, depth %.3f mm\n",
                std::string(tools::toolName(c.tool)).c_str(), c.stiffness, got.tissue, want.tissue,
                1e3 * got.depth);
    const bool needle = c.tool == tools::ToolKind::InjectionNeedle;
    const double law = needle ? kYield + kFriction * want.depth : c.stiffness * want.depth;
    EXPECT_NEAR(want.tissue, law, 0.05 * law);
    EXPECT_NEAR(got.tissue, want.tissue, c.stiffness * c.down / 2 * (needle ? late : 0.001));
    EXPECT_EQ(got.punctured, needle ? 1 : 0);
    EXPECT_EQ(got.air, 0.0);
    EXPECT_LT(std::abs(got.back), 1e-6) << "nothing in the air";
  }
}

}  // namespace

TEST(VoxelDevices, AnImageIsFeltThroughThePhantomAsThroughTheSimulatedDevice) {
  FakeLibrary fake{FAKE_HD};
  PhantomDevice device;
  feelsTheSame(
      device, {{"library", FAKE_HD}}, {{"maximum_force", "3.3"}, {"continuous", "0.88"}},
      [&](Served& s) {
        s.serve = [&] { fake.get<void(int)>("fakehd_step")(1); };
        s.shown = [&] {
          double f[3];
          fake.get<void(double*)>("fakehd_shown")(f);
          return f[1];  // the maker's y is up
        };
        s.wish = [&](double z) { fake.get<void(double, double, double)>("fakehd_wish")(0, z, 0); };
      },
      [&] {
        fake.get<void()>("fakehd_reset")();
        fake.get<void()>("fakehd_manual")();
      },
      0.001);
  EXPECT_EQ(fake.get<int()>("fakehd_violations")(), 0) << fake.get<const char*()>("fakehd_violation")();
}

TEST(VoxelDevices, AnImageIsFeltThroughForceDimensionAsThroughTheSimulatedDevice) {
  FakeLibrary fake{FAKE_DHD};
  ForceDimensionDevice device;
  feelsTheSame(
      device, {{"library", FAKE_DHD}}, {{"maximum_force", "8"}},
      [&](Served& s) {
        s.serve = [] { std::this_thread::sleep_for(1ms); };
        s.shown = [&] {
          double f[3];
          fake.get<void(double*)>("fakedhd_shown")(f);
          return f[2];
        };
        s.wish = [&](double z) { fake.get<void(double, double, double)>("fakedhd_wish")(0, 0, z); };
      },
      [&] { fake.get<void()>("fakedhd_reset")(); }, MailboxDevice::kReadingLife);
  EXPECT_EQ(fake.get<int()>("fakedhd_violations")(), 0);
}

namespace {

/// The emulator in a process of its own, whose hand goes 20 mm down and up, again and again.
struct PressingHand {
  std::string link = "/tmp/vest_voxel_lie_" + std::to_string(::getpid()), force = link + "_force",
              log = link + ".csv";
  pid_t pid = -1;
  PressingHand() {
    pid = ::fork();
    if (pid == 0) {
      ::execl(EMULATOR, EMULATOR, "--link", link.c_str(), "--force-link", force.c_str(), "--log", log.c_str(),
              "--motion", "press", "--seconds", "300", nullptr);
      ::_exit(127);
    }
    for (int i = 0; i < kPatience / 10 && ::access(force.c_str(), F_OK) != 0; ++i)
      std::this_thread::sleep_for(10ms);
  }
  ~PressingHand() {
    ::kill(pid, SIGTERM);
    ::waitpid(pid, nullptr, 0);
    ::unlink(log.c_str());
  }
  /// N along the shaft, into the patient: what the motors show, by the newest whole row.
  double shown() const {
    std::ifstream file(log, std::ios::ate);
    const std::streamoff end = file.tellg(), from = std::max<std::streamoff>(0, end - 400);
    file.seekg(from);
    std::string line, whole;
    if (from > 0) std::getline(file, line);
    while (std::getline(file, line))
      if (!file.eof()) whole = line;
    double loads[3] = {};
    long long ns = 0;
    std::sscanf(whole.c_str(), "%lld,%lf,%lf,%lf", &ns, &loads[0], &loads[1], &loads[2]);
    return loads[2];
  }
};

}  // namespace

// The emulator's hand keeps its own time, and its shaft turns round where forces are judged: at the bottom of
// a press. A press that a busy machine disturbs is followed by others.
// The passivity control may brake in the air what came late. A needle is left to the other devices.
TEST(VoxelDevices, ElasticitiesAreFeltThroughTheImpulseEngineAsThroughTheSimulatedDevice) {
  constexpr double kCount = 1.0 / 20000, kRow = 5e-5, kAbove = 0.010;  // m of an encoder, N of a row, m
  for (const double stiffness : {40.0, 64.0, 160.0}) {
    SCOPED_TRACE(stiffness);
    ControllerOptions options;
    options.arm = vest::haptics::testing::arm();
    options.arm.aim_B.z() = kSurface + kAbove;
    options.arm.pivot_B.z() = options.arm.aim_B.z() + 0.12;
    options.arm.X_BTrocar = kinematics::trocarFrame(options.arm.pivot_B, options.arm.aim_B);
    double want = 0, got = 0;
    {
      SimulatedDevice device;
      device.open({{"axes", "joints"}, {"motion", "press"}, {"maximum_force", "8"}});
      scene::World world(block(stiffness));
      Trial trial(world, tools::ToolKind::Grasper, device, options);
      for (std::int64_t i = 1; i <= 12000; ++i) {  // the gate opens during the first press
        trial.tick(i * kMs, 0.0);
        if (i > 8000) want = std::min(want, device.shown()[2]);
      }
    }
    PressingHand hand;
    ImpulseEngineDevice device;
    device.open({{"port", hand.link}, {"force", "emulator"}, {"force_port", hand.force}});
    Served served(device);
    served.serve = [] { std::this_thread::sleep_for(1ms); };
    served.shown = [&] { return served.last[2]; };  // frames come in their own time
    scene::World world(block(stiffness));
    Trial trial(world, tools::ToolKind::Grasper, served, options);
    // One count of the encoder either way, the frame's 16 bits and the row's digits are between them.
    const double bound = stiffness * kCount + 8.0 / 32767 + kRow;
    std::int64_t now = 0;
    double air = 1, now_air = 0, most = 0;
    bool down = false;
    for (int presses = 0; presses < 60 && !(air == 0 && std::abs(got - want) <= bound);) {
      now = std::max(now + kMs, Loop::steadyNow());
      const double tip = trial.tick(now, 0.0).tip.z() - kSurface, shown = hand.shown();
      most = std::min(most, shown);
      if (tip > 0.5 * kAbove) now_air = std::max(now_air, std::abs(shown));
      down = down || tip < 0;
      if (down && tip > 0.9 * kAbove) {
        got = most, air = now_air;
        std::printf("press %d: %.4f N, simulated %.6f N, bound %.4f\n", presses, got, want, bound);
        most = now_air = 0, down = false, ++presses;
      }
    }
    EXPECT_NEAR(got, want, bound);
    EXPECT_EQ(air, 0.0) << "on the way back out";
    EXPECT_LT(want, -0.1);
  }
}
