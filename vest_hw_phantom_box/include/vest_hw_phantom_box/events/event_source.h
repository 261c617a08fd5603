/// Events of pedals and gamepads, as the kernel's event interface (linux/input.h) tells them.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>

#include "vest_instruments/control/input_map.h"

namespace vest::events {

/// One event; numbers of linux/input-event-codes.h.
struct Event {
  std::uint16_t type = 0, code = 0;
  std::int32_t value = 0;  ///< of a key: 0 up, 1 down, 2 repeated
};

/// Range of an axis in the device's own steps.
struct AxisRange {
  std::int32_t minimum = 0, maximum = 0;
  std::int32_t flat = 0;   ///< rest position ± this counts as rest
  std::int32_t value = 0;  ///< at present
};

/// Where events come from: the kernel through libevdev, or a recording.
class EventSource {
 public:
  enum class Read { Event, Nothing, Gone };
  virtual ~EventSource() = default;
  /// Never waits. @param now steady time, s. Gone: the device was unplugged; nothing more will come.
  virtual Read next(Event& event, double now) = 0;
  virtual bool hasKey(std::uint16_t code) const = 0;
  virtual bool keyDown(std::uint16_t code) const = 0;  ///< at present
  virtual std::optional<AxisRange> axis(std::uint16_t code) const = 0;
  virtual std::string name() const = 0;
};

/// A device that cannot be used; what() says which, why, and what mends it.
class DeviceError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Code of a name of linux/input-event-codes.h, e.g. BTN_SOUTH; empty where there is none.
std::optional<std::uint16_t> keyCode(const std::string& name);
std::optional<std::uint16_t> axisCode(const std::string& name);

/// Opens what an input map names. @param folder where event devices lie @throws DeviceError
std::unique_ptr<EventSource> openSource(const control::EventDevice& device,
                                        const std::string& folder = "/dev/input");
/// A device of the kernel by its path. @throws DeviceError
std::unique_ptr<EventSource> openKernelDevice(const std::string& path, bool grab);
/// The same over a descriptor that is open already; takes it over. @throws DeviceError
std::unique_ptr<EventSource> openKernelDevice(int descriptor, const std::string& label, bool grab);

/// Plays a recording: lines `t_s,type,code,value` with names (EV_KEY, BTN_SOUTH), times counted from the
/// first call of next(). Lines before the head say what the device has: `# name: …`, `# key: BTN_SOUTH`,
/// `# axis: ABS_X minimum maximum flat`, `# gone: t_s` where it is unplugged, `# loop: t_s` where it begins
/// anew.
/// @throws DeviceError naming file, line and what is allowed
std::unique_ptr<EventSource> openRecording(const std::string& path);

}  // namespace vest::events
