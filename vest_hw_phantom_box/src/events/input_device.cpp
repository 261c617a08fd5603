#include "vest_hw_phantom_box/events/input_device.h"

#include <algorithm>

#include <linux/input.h>

namespace vest::events {

InputDevice::InputDevice(const control::EventDevice& wanted, std::unique_ptr<EventSource> source)
    : source_(std::move(source)) {
  const auto refuse = [&](const std::string& name, const std::string& why) {
    throw DeviceError("input device '" + wanted.name + "' (" + source_->name() + "): '" + name + "' " + why);
  };
  for (const std::string& name : wanted.buttons) {
    const auto code = keyCode(name);
    if (!code) refuse(name, "is no key; allowed: names of linux/input-event-codes.h, e.g. BTN_SOUTH");
    if (!source_->hasKey(*code)) refuse(name, "is not on this device; 'evtest' shows what it has");
    if (source_->keyDown(*code)) next_buttons_ |= 1u << keys_.size();
    keys_.push_back(*code);
  }
  for (const std::string& name : wanted.axes) {
    const auto code = axisCode(name);
    if (!code) refuse(name, "is no axis; allowed: names of linux/input-event-codes.h, e.g. ABS_X");
    const auto range = source_->axis(*code);
    if (!range) refuse(name, "is not on this device; 'evtest' shows what it has");
    if (range->maximum <= range->minimum) refuse(name, "has no range: the device is broken");
    ranges_.push_back({*code, *range});
    next_axes_.push_back(share(ranges_.back(), range->value));
  }
  buttons_ = next_buttons_;
  axes_ = next_axes_;
  pressed_at_.assign(keys_.size(), -1.0);
}

double InputDevice::share(const Axis& axis, std::int32_t value) const {
  const AxisRange& r = axis.range;
  const double half = 0.5 * (static_cast<double>(r.maximum) - r.minimum);
  const double flat = std::min(std::max(0.0, static_cast<double>(r.flat)), 0.9 * half);
  const double off = static_cast<double>(value) - (r.minimum + half);
  // Beyond the flat middle it begins at zero, so that nothing jumps at its edge.
  const double size = std::max(0.0, std::min(std::abs(off), half) - flat) / (half - flat);
  return off < 0.0 ? -size : size;
}

bool InputDevice::poll(double now) {
  if (!connected_) return false;
  bool changed = false;
  Event event;
  for (;;) {
    const EventSource::Read read = source_->next(event, now);
    if (read == EventSource::Read::Nothing) break;
    if (read == EventSource::Read::Gone) {
      connected_ = false;
      buttons_ = next_buttons_ = 0;
      std::fill(axes_.begin(), axes_.end(), 0.0);
      return true;
    }
    if (event.type == EV_KEY) {
      for (std::size_t i = 0; i < keys_.size(); ++i) {
        if (keys_[i] != event.code || event.value == 2) continue;
        next_buttons_ = event.value != 0 ? next_buttons_ | 1u << i : next_buttons_ & ~(1u << i);
      }
    } else if (event.type == EV_ABS) {
      for (std::size_t i = 0; i < ranges_.size(); ++i) {
        if (ranges_[i].code == event.code) next_axes_[i] = share(ranges_[i], event.value);
      }
    } else if (event.type == EV_SYN && event.code == SYN_REPORT) {
      changed = changed || buttons_ != next_buttons_ || axes_ != next_axes_;
      buttons_ = next_buttons_;
      axes_ = next_axes_;
    }
  }
  for (std::size_t i = 0; i < keys_.size(); ++i) {
    if ((buttons_ >> i & 1u) == 0)
      pressed_at_[i] = -1.0;
    else if (pressed_at_[i] < 0.0)
      pressed_at_[i] = now;
  }
  return changed;
}

std::uint32_t InputDevice::stuck(double now) const {
  std::uint32_t mask = 0;
  for (std::size_t i = 0; i < keys_.size(); ++i) {
    if (pressed_at_[i] >= 0.0 && now - pressed_at_[i] > kStuck) mask |= 1u << i;
  }
  return mask;
}

}  // namespace vest::events
