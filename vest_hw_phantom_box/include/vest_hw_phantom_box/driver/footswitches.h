// Six pedals: debounced, released when the data grows old.
#pragma once

#include <array>
#include <cstdint>

#include "vest_hw_phantom_box/protocol/frame.h"

namespace vest::driver {

using Nanoseconds = std::int64_t;
constexpr Nanoseconds kMillisecond = 1000000;

struct FootswitchOptions {
  Nanoseconds debounce = 10 * kMillisecond;    ///< a change counts once it has stood this long
  Nanoseconds timeout = 100 * kMillisecond;    ///< older data: all released
  Nanoseconds quick_tap = 200 * kMillisecond;  ///< shorter presses are quick taps (assumed)
  Nanoseconds stuck = 60000 * kMillisecond;    ///< pressed longer than this: warning (assumed)
};

/// 1 pressed, 0 released; a short press ends with 2 (CRTK's quick tap) directly before its 0.
struct PedalEvent {
  int pedal = 0;
  int value = 0;
};

class Footswitches {
 public:
  explicit Footswitches(const FootswitchOptions& options = {}) : options_(options) {}

  /// A reading of all six: bits 0…5. `device` is device time, `now` steady time of arrival.
  void reading(std::uint8_t mask, Nanoseconds device, Nanoseconds now);
  /// Time passes without a reading.
  void tick(Nanoseconds now);
  /// Release of everything at once (port gone, pedals unplugged for good).
  void releaseAll();
  /// A new connection: device time starts anew, what is pressed stays pressed until timeout.
  void newConnection();

  std::uint8_t pressed() const { return pressed_; }
  /// Pedals that have been down for longer than options.stuck.
  std::uint8_t stuck(Nanoseconds now) const;
  /// Takes the events since the last call; returns their number. More than fit cannot pile up: every change
  /// needs a debounce time, and the caller takes them after each call above.
  int take(std::array<PedalEvent, 4 * protocol::kFootswitches>& events);

 private:
  void change(int pedal, bool down, Nanoseconds now, bool may_be_tap);

  FootswitchOptions options_;
  std::uint8_t pressed_ = 0;
  bool has_reading_ = false;
  Nanoseconds last_device_ = 0;
  Nanoseconds last_now_ = 0;
  std::array<Nanoseconds, protocol::kFootswitches> differs_since_{};  ///< device time
  std::array<bool, protocol::kFootswitches> differs_{};
  std::array<Nanoseconds, protocol::kFootswitches> pressed_at_{};  ///< steady time
  std::array<PedalEvent, 4 * protocol::kFootswitches> events_{};
  int event_count_ = 0;
};

}  // namespace vest::driver
