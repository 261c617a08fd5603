#include "vest_hw_phantom_box/driver/time_map.h"

#include <algorithm>

namespace vest::driver {

std::int64_t TimeMap::stamp(std::uint32_t time_us, std::int64_t steady, std::int64_t wall) {
  const std::int64_t delay_now = [&] {
    if (!has_device_) {
      device_ns_ = static_cast<std::int64_t>(time_us) * 1000;
    } else {
      // Signed difference: correct across the wrap.
      device_ns_ += static_cast<std::int64_t>(static_cast<std::int32_t>(time_us - last_us_)) * 1000;
    }
    return steady - device_ns_;
  }();
  const std::int64_t passed = has_wall_ ? std::max<std::int64_t>(0, steady - last_steady_) : 0;
  least_delay_ = std::min(least_delay_, delay_now);
  if (!has_device_ || delay_now - steady_minus_device_ > kMaxDelay) {
    steady_minus_device_ = delay_now;
    begin_ = steady;
    least_delay_ = delay_now;
  } else if (steady - begin_ >= kWindow) {
    steady_minus_device_ = std::max(steady_minus_device_, least_delay_);
    begin_ = steady;
    least_delay_ = delay_now;
  } else {
    const auto drift = static_cast<std::int64_t>(kDrift * static_cast<double>(passed));
    steady_minus_device_ = std::min(delay_now, steady_minus_device_ + drift);
  }
  has_device_ = true;
  last_us_ = time_us;

  const std::int64_t wall_offset = wall - steady;
  if (!has_wall_) {
    wall_minus_steady_ = wall_offset;
  } else {
    constexpr std::int64_t kStep = 500000000;  // beyond half a second the clock was set, not disciplined
    wall_step_ = wall_offset - wall_minus_steady_;
    const auto slew = static_cast<std::int64_t>(kSlew * static_cast<double>(passed));
    if (wall_step_ > kStep) {
      wall_minus_steady_ = wall_offset;  // forward: following at once is harmless
    } else {
      wall_minus_steady_ += std::clamp(wall_step_, -slew, slew);
    }
  }
  has_wall_ = true;
  last_steady_ = steady;
  last_stamp_ = std::max(last_stamp_ + 1, device_ns_ + steady_minus_device_ + wall_minus_steady_);
  return last_stamp_;
}

}  // namespace vest::driver
