// Protects the hand from processes that die: a simulation of its own process is killed, stopped, or hangs, at
// random phases.
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <csignal>
#include <random>
#include <thread>

#include <gtest/gtest.h>

#include "support.h"
#include "vest_haptics/device/simulated.h"
#include "vest_haptics/loop/loop.h"

using namespace vest::haptics;
using namespace vest::haptics::testing;
using namespace std::chrono_literals;

namespace {

/// What parent and simulation share beside the contact memory.
struct Board {
  std::atomic<double> z{0.1};  ///< m, world: commanded tip, which is the device's own as in a session
  std::atomic<int> hang{0};    ///< 1: endless loop in the solver, while a heart-beat thread goes on writing
  std::atomic<std::int64_t> last{0};
  std::atomic<std::uint64_t> seen{0};  ///< newest step that the loop has read
};

[[noreturn]] void simulate(const std::string& memory, Board* board) {
  vest::shared::ContactWriter writer(memory);
  HalfSpace tissue;
  while (true) {
    const std::int64_t now = Loop::steadyNow();
    if (board->hang) {  // steps stand still, stamps do not
      tissue.image.steady_ns = now;
      // A loop that was not let run would take the last step for one that began with this stamp.
      if (board->seen == tissue.image.step) writer.write(tissue.image);
    } else {
      writer.write(*tissue.step({0, 0, board->z}, now));
      board->last = now;
    }
    std::this_thread::sleep_for(1ms);
  }
}

struct Session {
  const std::string name = "/vest_test_processes_" + std::to_string(::getpid());
  Board* board = nullptr;
  pid_t child = -1;
  SimulatedDevice device;
  std::shared_ptr<vest::shared::ContactReader> memory = std::make_shared<vest::shared::ContactReader>(name);
  std::unique_ptr<Loop> loop;
  double force = 0.0;
  std::int64_t now = 0;

  Session() {
    board =
        new (::mmap(nullptr, sizeof(Board), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0)) Board;
    start();
    device.open({});
    loop = std::make_unique<Loop>(device, options(), memory);
    loop->post(Command::Enable);
  }
  ~Session() {
    end();
    ::munmap(board, sizeof(Board));
    ::shm_unlink(name.c_str());
  }
  void start() {
    child = ::fork();
    if (child == 0) simulate(name, board);
  }
  void end() {
    ::kill(child, SIGKILL);
    ::waitpid(child, nullptr, 0);
  }
  void tick() {
    memory->connect();
    now = Loop::steadyNow();
    const TickReport& r = loop->tickOnce(now);
    if (r.valid) board->z = r.X_BTip.translation().z();
    board->seen = r.step;
    force = r.loads[2];
    device.advance(0.001);
    std::this_thread::sleep_for(1ms);
  }
  /// Out of the tissue, through the ramp, into it. False where the machine did not let the simulation run for
  /// long enough.
  bool press() {
    for (int attempt = 0; attempt < 50; ++attempt) {
      device.wish(2, 0.01);
      for (int i = 0; i < 6000; ++i) {
        tick();
        if (i > 200 && loop->tickOnce(Loop::steadyNow()).allowance >= 1.0) break;
      }
      device.wish(2, -0.006);
      for (int i = 0; i < 300; ++i) tick();
      if (force > 0.3) return true;
    }
    return false;
  }
};

}  // namespace

TEST(Processes, AKilledStoppedOrHangingSimulationIsZeroForceByFiftyMilliseconds) {
  std::mt19937 random(11);
  Session s;
  const auto phases = counted(1000, 6, "killed, stopped and hanging simulations");
  int seen = 0;
  for (int n = 0; n < phases; ++n) {
    ASSERT_TRUE(s.press()) << "phase " << n;
    std::this_thread::sleep_for(std::chrono::microseconds(random() % 1000));
    const int how = n % 3;
    if (how == 0) s.end();
    if (how == 1) ::kill(s.child, SIGSTOP);
    if (how == 2) s.board->hang = 1;
    int zero = 0, forced = 0;
    const std::int64_t begin = Loop::steadyNow();
    // A busy machine may let this process stand still past the deadline: it goes on until it has looked.
    while (Loop::steadyNow() - begin < (zero > 5 ? 200 : 10000) * kMs) {
      s.tick();
      const double age = 1e-9 * static_cast<double>(s.now - s.board->last);
      if (age >= 0.0505) {  // a step that was being written when the stamp was taken
        ASSERT_EQ(s.force, 0.0) << "phase " << n << " way " << how << " age " << age;
        ++zero;
      } else {
        forced += s.force > 0.0;
      }
    }
    EXPECT_GT(zero, 5) << "nothing was looked at after the deadline";
    seen += forced;
    if (how == 0) s.start();
    if (how == 1) ::kill(s.child, SIGCONT);
    if (how == 2) s.board->hang = 0;
    for (int i = 0; i < 100; ++i) {
      s.tick();
      ASSERT_EQ(s.force, 0.0) << "it came back with the hand inside: no kick";
    }
  }
  EXPECT_GT(seen, 0) << "there was no force before the deadline either";
}

TEST(Processes, EndingTheLoopLeavesZeroForceAtARandomPhase) {
  std::mt19937 random(2);
  int forced = 0;
  const auto ends = counted(100, 5, "ends at random phases");
  for (int n = 0; n < ends; ++n) {
    SimulatedDevice device;
    device.open({});
    auto memory = std::make_shared<vest::shared::ContactReader>("/vest_test_nothing");
    Loop loop(device, options(), memory);
    loop.post(Command::Enable);
    loop.start();
    // Servo forces need no simulation.
    for (int i = 0; i < 150; ++i) {
      loop.servo({0, 0, i > 60 ? 2.0 : 0.0}, Loop::steadyNow());
      std::this_thread::sleep_for(1ms);
    }
    std::this_thread::sleep_for(std::chrono::microseconds(random() % 2000));
    loop.reports().update();
    forced += loop.reports().front().loads[2] > 0.0;
    if (n % 2) loop.halt();  // what the signal handler does
    if (n % 2) {
      std::this_thread::sleep_for(20ms);
      EXPECT_EQ(device.shown(), Loads{});
    }
    loop.stop();
    device.advance(0.001);
    EXPECT_EQ(device.shown(), Loads{});
  }
  EXPECT_GT(forced, 0) << "there was no force to end";
}

namespace {

/// Reads well and takes no force.
struct Refusing : SimulatedDevice {
  DeviceStatus write(const Loads&) noexcept override { return DeviceStatus::Error; }
};

}  // namespace

TEST(Processes, ADeviceThatRefusesForcesIsAFaultOfTheLoop) {
  Refusing device;
  device.open({});
  Loop loop(device, options(), std::make_shared<vest::shared::ContactReader>("/vest_test_nothing"));
  loop.post(Command::Enable);
  loop.tickOnce(Loop::steadyNow());
  EXPECT_EQ(loop.tickOnce(Loop::steadyNow() + kMs).fault, Fault::DeviceError);
}

TEST(Processes, AFaultFromOutsideIsTakenAtTheNextTickAndCommandsToo) {
  SimulatedDevice device;
  device.open({});
  Loop loop(device, options(), std::make_shared<vest::shared::ContactReader>("/vest_test_nothing"));
  loop.post(Command::Enable);
  EXPECT_EQ(loop.tickOnce(Loop::steadyNow()).state, vest::control::OperatingState::Enabled);
  loop.raise(Fault::Publisher);
  EXPECT_EQ(loop.tickOnce(Loop::steadyNow() + kMs).fault, Fault::Publisher);
}

TEST(Processes, OfCommandsWithinOneTickNoneIsLostAndADisableLeast) {
  using vest::control::OperatingState;
  SimulatedDevice device;
  device.open({});
  Loop loop(device, options(), std::make_shared<vest::shared::ContactReader>("/vest_test_nothing"));
  std::int64_t now = Loop::steadyNow();
  const auto after = [&](std::initializer_list<Command> commands) {
    for (const Command c : commands) loop.post(c);
    return loop.tickOnce(now += kMs).state;
  };
  EXPECT_EQ(after({Command::Enable}), OperatingState::Enabled);
  EXPECT_EQ(after({Command::Disable, Command::Resume}), OperatingState::Disabled) << "what stops counts";
  EXPECT_EQ(loop.refused(), 1u << static_cast<int>(Command::Resume)) << "what does not fit is told";
  EXPECT_EQ(after({Command::Enable, Command::Pause}), OperatingState::Paused) << "each in its turn";
  EXPECT_EQ(loop.refused(), 0u);
  loop.raise(Fault::Publisher);
  EXPECT_EQ(after({}), OperatingState::Fault);
  EXPECT_EQ(after({Command::Enable}), OperatingState::Fault);
  EXPECT_EQ(loop.refused(), 1u << static_cast<int>(Command::Enable));
  // As a client that leaves a fault sends them: in one packet.
  EXPECT_EQ(after({Command::Disable, Command::Enable}), OperatingState::Enabled);
  // A flood: more than can wait. Force goes.
  for (int i = 0; i < 16; ++i) loop.post(Command::Enable);
  EXPECT_EQ(after({}), OperatingState::Enabled) << "sixteen wait";
  for (int i = 0; i < 17; ++i) loop.post(Command::Enable);
  EXPECT_EQ(after({}), OperatingState::Disabled) << "seventeen do not";
}
