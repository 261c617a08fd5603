#include "vest_haptics/conformance/conformance.h"

#include <atomic>
#include <chrono>
#include <cmath>
#include <thread>

#include "vest_haptics/device/sensor_check.h"

namespace vest::haptics::conformance {
namespace {

using clock = std::chrono::steady_clock;

std::int64_t steadyNow() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(clock::now().time_since_epoch()).count();
}

/// Tells a reading that the device lost from one that a busy machine did not let come: an empty loop beside
/// the suite, as a control. Where that was late, readings are not judged until a device's thread had its turn
/// again.
class Control {
 public:
  Control()
      : thread_([this] {
          auto due = clock::now();
          while (!stop_) {
            std::this_thread::sleep_until(due += std::chrono::milliseconds(1));
            const auto late = clock::now() - due;
            if (late < kLate) continue;
            busy_until_ = steadyNow() + kRest;
            due = clock::now();
          }
        }) {}
  ~Control() {
    stop_ = true;
    thread_.join();
  }
  bool quiet() const { return steadyNow() > busy_until_; }

 private:
  static constexpr std::chrono::milliseconds kLate{3};
  static constexpr std::int64_t kRest = 50000000;  // ns
  std::atomic<bool> stop_{false};
  std::atomic<std::int64_t> busy_until_{0};
  std::thread thread_;
};

}  // namespace

std::vector<Finding> run(Device& device, const Options& options) {
  std::vector<Finding> out;
  const auto say = [&](const std::string& promise, bool kept, const std::string& detail = {}) {
    out.push_back({promise, kept, detail});
    return kept;
  };
  Sample sample;
  // Before open().
  const bool quiet = device.read(sample) != DeviceStatus::Ok;
  say("a device that is not open gives no reading", quiet);
  {
    DeviceOptions wrong = options.device;
    wrong["no_such_option"] = "1";
    std::string text;
    try {
      device.open(wrong);
    } catch (const DeviceError& e) {
      text = e.what();
    }
    say("an unknown option is refused by name", text.find("no_such_option") != std::string::npos, text);
    device.close();
  }
  const auto open = [&](const char* promise) {
    try {
      device.open(options.device);
    } catch (const std::exception& e) {
      return say(promise, false, e.what());
    }
    return say(promise, true);
  };
  if (!open("it opens")) return out;

  const Capabilities& c = device.capabilities();
  say("its capabilities are numbers that a device can have", unsound(c).empty(), unsound(c));

  // First reading.
  DeviceStatus status = DeviceStatus::Starting;
  const auto began = clock::now();
  while (clock::now() - began < std::chrono::seconds(3)) {
    status = device.read(sample);
    if (status == DeviceStatus::Ok) break;
    device.write(Loads{});
    device.advance(0.001);
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  if (status == DeviceStatus::Uncalibrated) {
    say("without calibration it says what the hand must do", !device.calibrationHint().empty(),
        device.calibrationHint());
    device.close();
    return out;
  }
  if (!say("the first reading comes within 3 s", status == DeviceStatus::Ok, statusName(status))) {
    device.close();
    return out;
  }

  // A loop of 1 kHz: forces off, then a small force.
  SensorCheck check(c);
  Loads small{};
  if (c.joints)
    small[2] = 0.02 * c.maximum[2];
  else
    small[2] = 0.02 * c.maximum[0];
  int rejected = 0, lost = 0, judged = 0, errors = 0, slow = 0;
  std::uint64_t allocated = 0;
  double most_turn = 0.0;
  Control control;
  const auto loop = [&](double seconds, const Loads& loads) {
    const int ticks = static_cast<int>(seconds * 1000);
    judged = 0;
    auto due = clock::now();
    // On a busy machine longer, until enough could be judged.
    for (int i = 0; judged < ticks && i < 20 * ticks; ++i) {
      const std::uint64_t had = options.allocations ? options.allocations() : 0;
      timespec a{}, b{};
      ::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &a);
      const DeviceStatus read = device.read(sample);
      const DeviceStatus written = device.write(loads);
      ::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &b);
      if (options.allocations) allocated += options.allocations() - had;
      slow +=
          1e9 * static_cast<double>(b.tv_sec - a.tv_sec) + static_cast<double>(b.tv_nsec - a.tv_nsec) > 200e3;
      if (control.quiet()) {
        ++judged;
        lost += read != DeviceStatus::Ok;
      }
      errors += read == DeviceStatus::Error || written == DeviceStatus::Error;
      if (c.orientation) most_turn = std::max(most_turn, std::abs(sample.orientation.norm() - 1.0));
      Sample copy = sample;
      rejected += check.check(copy, steadyNow()) != SensorCheck::Verdict::Good;
      device.advance(0.001);
      std::this_thread::sleep_until(due += std::chrono::milliseconds(1));
    }
  };
  device.enableForces(false);
  loop(options.seconds, Loads{});
  say("readings go on coming", judged > 0 && lost <= 2,
      std::to_string(lost) + " of " + std::to_string(judged) + " ticks without one");
  say("a hand can make every motion that it reports", rejected == 0,
      std::to_string(rejected) + " readings not finite, or jumps");
  say("attitudes are rotations", most_turn < 1e-3);
  if (options.small_force && c.force) {
    device.enableForces(true);
    loop(0.1, small);
    device.write(Loads{});
    device.enableForces(false);
    say("it takes forces without an error", errors == 0, device.lastError());
  }
  say("reading and writing take less than 0.2 ms of CPU time", slow <= 1, std::to_string(slow) + " slower");
  if (options.allocations)
    say("reading and writing allocate nothing", allocated == 0, std::to_string(allocated) + " allocations");

  device.close();
  device.close();
  say("closing is idempotent and ends the readings", device.read(sample) != DeviceStatus::Ok);
  if (open("it opens again")) {
    DeviceStatus again = DeviceStatus::Starting;
    const auto since = clock::now();
    while (clock::now() - since < std::chrono::seconds(3) && again != DeviceStatus::Ok) {
      again = device.read(sample);
      device.write(Loads{});
      device.advance(0.001);
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    say("and reads again", again == DeviceStatus::Ok, statusName(again));
  }
  device.close();
  return out;
}

}  // namespace vest::haptics::conformance
