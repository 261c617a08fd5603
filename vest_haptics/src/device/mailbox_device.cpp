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
  return DeviceStatus::Ok;
}

DeviceStatus MailboxDevice::write(const Loads& loads) noexcept {
  wanted_.back().loads = loads;
  wanted_.back().ns = steadyNow();
  wanted_.publish();
  return code_ != 0 ? DeviceStatus::Error : static_cast<DeviceStatus>(status_.load());
}

void MailboxDevice::deliver(const Sample& sample, std::int64_t now_ns) noexcept {
  readings_.back().sample = sample;
  readings_.back().ns = now_ns;
  readings_.publish();
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
  const bool old = now_ns - w.ns > static_cast<std::int64_t>(kCommandLife * 1e9);
  return !forcesOn() || old || !withinMaximum(w.loads) ? Loads{} : w.loads;
}

std::string MailboxDevice::lastError() const {
  const std::uint32_t code = code_;
  return code == 0 ? "" : describe(code);
}

}  // namespace vest::haptics
