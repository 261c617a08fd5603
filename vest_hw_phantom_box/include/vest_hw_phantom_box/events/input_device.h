#pragma once

#include <vector>

#include "vest_hw_phantom_box/events/event_source.h"

namespace vest::events {

/// The buttons and axes of one device that an input map names, in the map's order.
class InputDevice {
 public:
  static constexpr double kStuck = 60.0;  ///< s: longer than any press in training (assumed, as for the box)

  /// @throws DeviceError where a name is unknown to the kernel or the device lacks it
  InputDevice(const control::EventDevice& wanted, std::unique_ptr<EventSource> source);

  /// Takes all events that have come. True where something changed since the last call. Changes count at the
  /// end of a report (SYN_REPORT), so that no half of one is seen.
  bool poll(double now);
  /// False once it was unplugged; all is released then, and axes are at rest.
  bool connected() const { return connected_; }
  std::uint32_t buttons() const { return buttons_; }         ///< bit i: button i is down
  const std::vector<double>& axes() const { return axes_; }  ///< −1 … 1, 0 at rest
  std::uint32_t stuck(double now) const;                     ///< down for longer than kStuck
  std::string name() const { return source_->name(); }

 private:
  struct Axis {
    std::uint16_t code;
    AxisRange range;
  };
  double share(const Axis& axis, std::int32_t value) const;

  std::unique_ptr<EventSource> source_;
  std::vector<std::uint16_t> keys_;
  std::vector<Axis> ranges_;
  bool connected_ = true;
  std::uint32_t buttons_ = 0, next_buttons_ = 0;
  std::vector<double> axes_, next_axes_, pressed_at_;
};

}  // namespace vest::events
