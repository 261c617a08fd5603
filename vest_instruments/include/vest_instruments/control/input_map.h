/// One file says which source of input moves which instrument, and what every switch does.
#pragma once

#include <array>
#include <map>
#include <string>
#include <vector>

#include "vest_instruments/control/instrument.h"
#include "vest_instruments/control/pedals.h"

namespace vest::control {

/// A device of the kernel's event interface (USB pedals, a gamepad), or a recording of one. Its buttons and
/// axes keep the order of the file: button 0 is the first of `buttons`.
struct EventDevice {
  std::string name;                  ///< topic input/NAME
  std::string path;                  ///< /dev/input/by-id/…; exactly one of path, match, recording is given
  std::string match;                 ///< part of the name that the kernel gives the device
  std::string recording;             ///< events as CSV; relative to the map's file in the file, absolute here
  bool grab = true;                  ///< nobody else gets its events: a pedal that types letters types none
  std::vector<std::string> buttons;  ///< names of linux/input-event-codes.h: KEY_A, BTN_SOUTH …
  std::vector<std::string> axes;     ///< ABS_X …
};

/// What turns one joint by speed: an axis of the device, or a pair of buttons.
struct JointControl {
  int axis = -1;              ///< index into EventDevice::axes; < 0: none
  double sign = 1.0;          ///< -1 where the file writes -ABS_X
  int minus = -1, plus = -1;  ///< indices into EventDevice::buttons; < 0: none
};

/// A gamepad that moves an instrument: deflection is speed. Order: yaw, pitch, insertion, roll, jaw.
struct PadControl {
  std::array<JointControl, 5> joints;
  double speed = 0.04;  ///< m/s of the insertion at full deflection (assumed: calm hands in box training)
  double turn = 0.6;    ///< rad/s of yaw, pitch, jaw; roll turns at twice that (assumed)
};

/// Who moves one instrument.
struct InstrumentInput {
  Source source = Source::None;
  tools::Instrument handle = tools::Instrument::Left;  ///< box and replay: whose joints
  std::string device;  ///< haptic: word of vest_haptics; gamepad: name of an event device; else empty
  std::map<std::string, std::string> options;  ///< haptic: of the device
  PadControl pad;                              ///< gamepad, which counts as Source::Teleop
  bool gamepad() const { return source == Source::Teleop && !device.empty(); }
};

/// Switches of one source.
struct SwitchSource {
  std::string on;                ///< box, teleop, replay, haptics/NAME, or the name of an event device
  std::vector<Switch> switches;  ///< each button at most once for an instrument
  std::string topic() const;     ///< of its sensor_msgs/Joy, relative to the session's namespace
};

struct InputMap {
  std::vector<EventDevice> devices;
  std::array<InstrumentInput, tools::kInstrumentCount> instruments;
  std::vector<SwitchSource> switches;
};

/// Reads a map (format: README.md of vest_instruments). Strict, as loadTrainerBox() is. Names of buttons and
/// axes are checked against the device's own lists here, and against the kernel's names by whoever opens it.
/// @throws files::FileError: one message that names file, field, value and what is allowed
InputMap loadInputMap(const std::string& path);

}  // namespace vest::control
