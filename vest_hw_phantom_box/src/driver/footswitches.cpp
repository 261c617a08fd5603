#include "vest_hw_phantom_box/driver/footswitches.h"

namespace vest::driver {

using protocol::kFootswitches;

void Footswitches::change(int pedal, bool down, Nanoseconds now, bool may_be_tap) {
  const auto push = [this](int p, int value) {
    if (event_count_ < static_cast<int>(events_.size())) events_[event_count_++] = {p, value};
  };
  if (down) {
    pressed_ = static_cast<std::uint8_t>(pressed_ | (1u << pedal));
    pressed_at_[pedal] = now;
    push(pedal, 1);
  } else {
    pressed_ = static_cast<std::uint8_t>(pressed_ & ~(1u << pedal));
    if (may_be_tap && now - pressed_at_[pedal] < options_.quick_tap) push(pedal, 2);
    push(pedal, 0);
  }
  differs_[pedal] = false;
}

void Footswitches::reading(std::uint8_t mask, Nanoseconds device, Nanoseconds now) {
  tick(now);
  // What happened inside a hole in the data is unknown: a change must stand for the whole time, seen.
  const bool hole = device - last_device_ > options_.debounce;
  for (int i = 0; i < kFootswitches; ++i) {
    const bool down = mask & (1u << i);
    const bool was = pressed_ & (1u << i);
    if (down == was) {
      differs_[i] = false;
    } else if (!differs_[i] || hole) {
      differs_[i] = true;
      differs_since_[i] = device;
    } else if (device - differs_since_[i] >= options_.debounce) {
      change(i, down, now, true);
    }
  }
  has_reading_ = true;
  last_device_ = device;
  last_now_ = now;
}

void Footswitches::tick(Nanoseconds now) {
  if (has_reading_ && now - last_now_ > options_.timeout) releaseAll();
}

void Footswitches::releaseAll() {
  // Not a tap: nobody saw the foot leave.
  for (int i = 0; i < kFootswitches; ++i)
    if (pressed_ & (1u << i)) change(i, false, 0, false);
  differs_.fill(false);
  has_reading_ = false;
}

void Footswitches::newConnection() {
  differs_.fill(false);  // the next reading that differs is the first
}

std::uint8_t Footswitches::stuck(Nanoseconds now) const {
  std::uint8_t mask = 0;
  for (int i = 0; i < kFootswitches; ++i)
    if ((pressed_ & (1u << i)) && now - pressed_at_[i] > options_.stuck)
      mask |= static_cast<std::uint8_t>(1u << i);
  return mask;
}

int Footswitches::take(std::array<PedalEvent, 4 * kFootswitches>& events) {
  const int n = event_count_;
  for (int i = 0; i < n; ++i) events[i] = events_[i];
  event_count_ = 0;
  return n;
}

}  // namespace vest::driver
