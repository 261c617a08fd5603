#include "vest_haptics/device/mailbox_device.h"

#include <cmath>
#include <ctime>

namespace vest::haptics {

std::int64_t MailboxDevice::steadyNow() noexcept {
  timespec t{};
  ::clock_gettime(CLOCK_MONOTONIC, &t);
  return static_cast<std::int64_t>(t.tv_sec) * 1000000000 + t.tv_nsec;
}

void MailboxDevice::begin() noexcept {
  forces_on_ = false;
  code_ = 0;
  setStatus(DeviceStatus::Starting);
  readings_.back().ns = -1;
  readings_.publish();
  delivered_ns_ = -1;
  read_ns_ = posed_ns_ = served_ns_ = -1;
  period_ = delay_ = 0.0;
  wanted_.back().ns = -1;
  wanted_.publish();
}

DeviceStatus MailboxDevice::read(Sample& sample) noexcept {
  if (code_ != 0) return DeviceStatus::Error;
  const auto status = static_cast<DeviceStatus>(status_.load());
  readings_.update();
  if (status != DeviceStatus::Ok) return status;
  const Reading& reading = readings_.front();
  if (steadyNow() - reading.ns > static_cast<std::int64_t>(kReadingLife * 1e9))
    return DeviceStatus::Unplugged;
  sample = reading.sample;
  read_ns_ = reading.ns;
  return DeviceStatus::Ok;
}

DeviceStatus MailboxDevice::write(const Loads& loads) noexcept {
  wanted_.back().loads = loads;
  wanted_.back().ns = steadyNow();
  wanted_.back().posed_ns = read_ns_;
  wanted_.publish();
  return code_ != 0 ? DeviceStatus::Error : static_cast<DeviceStatus>(status_.load());
}

void MailboxDevice::deliver(const Sample& sample, std::int64_t now_ns) noexcept {
  readings_.back().sample = sample;
  readings_.back().ns = now_ns;
  readings_.publish();
  delivered_ns_ = now_ns;
}

void MailboxDevice::fail(std::uint32_t code) noexcept {
  std::uint32_t none = 0;
  code_.compare_exchange_strong(none, code == 0 ? 0xffffffffu : code);  // the first error is the cause
}

bool MailboxDevice::withinMaximum(const Loads& loads) const noexcept {
  constexpr double kRounding = 1.0 + 1e-9;
  if (!capabilities_.joints) {
    const double square = loads[0] * loads[0] + loads[1] * loads[1] + loads[2] * loads[2];
    return std::sqrt(square) <= capabilities_.maximum[0] * kRounding;  // false for what is no number
  }
  for (std::size_t i = 0; i < kChannels; ++i) {
    if (!(std::abs(loads[i]) <= capabilities_.maximum[i] * kRounding)) return false;
  }
  return true;
}

Loads MailboxDevice::wanted(std::int64_t now_ns) noexcept {
  wanted_.update();
  const Wanted& w = wanted_.front();
  measure(w.posed_ns, now_ns);
  const bool old = now_ns - w.ns > static_cast<std::int64_t>(kCommandLife * 1e9);
  const bool blind = now_ns - delivered_ns_ > static_cast<std::int64_t>(kPoseLife * 1e9) ||
                     status_ != static_cast<int>(DeviceStatus::Ok);
  return !forcesOn() || old || blind || !withinMaximum(w.loads) ? Loads{} : w.loads;
}

// Between two forces of new poses the age of the pose behind the force grows evenly from where it began.
void MailboxDevice::measure(std::int64_t posed_ns, std::int64_t now_ns) noexcept {
  constexpr double kMean = 0.5;      // s, of the means, tuned
  constexpr double kLongest = 0.05;  // s: a pause, no rate
  if (posed_ns == posed_ns_) return;
  const double held = 1e-9 * static_cast<double>(now_ns - served_ns_);
  if (held < kLongest) {
    const double lag = 1e-9 * static_cast<double>(served_ns_ - posed_ns_) + 0.5 * held;
    const double k = period_ > 0.0 ? held / (kMean + held) : 1.0;
    lag_ += k * (lag - lag_);
    held_ += k * (held - held_);
    period_ = held_;
    delay_ = lag_ - 0.5 * held_;
  }
  posed_ns_ = posed_ns;
  served_ns_ = now_ns;
}

std::string MailboxDevice::lastError() const {
  const std::uint32_t code = code_;
  return code == 0 ? "" : describe(code);
}

}  // namespace vest::haptics
