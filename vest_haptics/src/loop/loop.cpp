#include "vest_haptics/loop/loop.h"

#include <algorithm>
#include <cerrno>
#include <ctime>

#include "vest_haptics/device/realtime.h"

namespace vest::haptics {
namespace {

std::int64_t clockNow(clockid_t clock) noexcept {
  timespec t{};
  ::clock_gettime(clock, &t);
  return static_cast<std::int64_t>(t.tv_sec) * 1000000000 + t.tv_nsec;
}

}  // namespace

std::int64_t Loop::steadyNow() noexcept {
  return clockNow(CLOCK_MONOTONIC);
}

Loop::Loop(Device& device, const ControllerOptions& options, std::shared_ptr<shared::ContactReader> memory)
    : device_(device),
      options_(options),
      controller_(device.capabilities(), options),
      memory_(std::move(memory)) {}

Loop::~Loop() {
  stop();
}

void Loop::start() {
  if (thread_.joinable()) return;
  stop_ = false;
  thread_ = std::thread([this] { run(); });
}

void Loop::stop() {
  if (!thread_.joinable()) return;
  stop_ = true;
  thread_.join();
}

void Loop::servo(const Eigen::Vector3d& force, std::int64_t now_ns) noexcept {
  servo_.back().force = force;
  servo_.back().ns = now_ns;
  servo_.publish();
}

void Loop::post(Command command) noexcept {
  constexpr auto kDisable = static_cast<std::uint64_t>(Command::Disable) + 1;
  std::uint64_t waiting = commands_, all = 0;
  do {
    // Of a flood a disable alone is left.
    all = waiting >> 60 != 0 ? kDisable : waiting << 4 | (static_cast<std::uint64_t>(command) + 1);
  } while (!commands_.compare_exchange_weak(waiting, all));
}

void Loop::takeCommands() noexcept {
  const std::uint64_t waiting = commands_.exchange(0);
  for (int place = 60; place >= 0; place -= 4) {
    const auto next = static_cast<unsigned>(waiting >> place & 15u);
    if (next != 0 && !controller_.command(static_cast<Command>(next - 1))) refused_ |= 1u << (next - 1);
  }
}

const TickReport& Loop::tickOnce(std::int64_t now_ns) noexcept {
  takeCommands();
  if (const int fault = fault_.exchange(0)) controller_.raise(static_cast<Fault>(fault));
  if (halt_) controller_.command(Command::Disable);
  input_.now_ns = now_ns;
  input_.status = device_.read(input_.sample);
  input_.timing = device_.timing();
  any_image_ = memory_->read(image_) || any_image_;
  input_.image = any_image_ ? &image_ : nullptr;
  input_.volume = memory_->volume(image_.volume);
  if (servo_.update()) {
    input_.servo_force = servo_.front().force;
    input_.servo_ns = servo_.front().ns;
  }
  const TickReport& report = controller_.tick(input_);
  // Zero goes out even where forces are off: a device with a watchdog sees a live loop.
  device_.enableForces(report.forces_on);
  if (device_.write(report.loads) == DeviceStatus::Error) {
    controller_.raise(Fault::DeviceError);
    device_.enableForces(false);
  }
  return report;
}

void Loop::run() {
  realtime_ = becomeRealTime("vest_haptics");
  const auto period = static_cast<std::int64_t>(options_.period * 1e9);
  std::int64_t due = steadyNow();
  while (!stop_) {
    const std::int64_t now = steadyNow();
    const std::int64_t cpu = clockNow(CLOCK_THREAD_CPUTIME_ID);
    reports_.back() = tickOnce(now);
    reports_.publish();
    device_.advance(options_.period);
    const auto used = static_cast<std::uint64_t>(clockNow(CLOCK_THREAD_CPUTIME_ID) - cpu);
    ++ticks_;
    if (used > cpu_max_ns_) cpu_max_ns_ = used;
    ++cpu_histogram_[std::min<std::uint64_t>(used / 1000, cpu_histogram_.size() - 1)];
    due += period;
    const std::int64_t after = steadyNow();
    if (after - due > period) {
      ++late_;
      // Far behind: lost ticks are not made up for, the hand has moved on.
      if (after - due > 10 * period) due = after;
    }
    const timespec until{due / 1000000000, due % 1000000000};
    while (::clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &until, nullptr) == EINTR && !stop_) {
    }
  }
  device_.write(Loads{});
  device_.enableForces(false);
}

LoopStatistics Loop::statistics() const {
  LoopStatistics s;
  s.ticks = ticks_;
  s.late = late_;
  s.cpu_max = 1e-9 * static_cast<double>(cpu_max_ns_.load());
  s.realtime = realtime_;
  std::uint64_t total = 0, sum = 0;
  for (const auto& bin : cpu_histogram_) total += bin;
  for (std::size_t i = 0; i < cpu_histogram_.size() && total > 0; ++i) {
    sum += cpu_histogram_[i];
    const double edge = 1e-6 * static_cast<double>(i + 1);
    if (s.cpu_p50 == 0.0 && 2 * sum >= total) s.cpu_p50 = edge;
    if (s.cpu_p9999 == 0.0 && static_cast<double>(sum) >= 0.9999 * static_cast<double>(total))
      s.cpu_p9999 = edge;
  }
  return s;
}

}  // namespace vest::haptics
