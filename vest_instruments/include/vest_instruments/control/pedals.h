#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "vest_instruments/tools/tool_kind.h"

namespace vest::control {

/// What a pedal does. Coagulate is for any tool that coagulates; the two after it are for the hook or the
/// forceps alone, as consoles have them.
enum class PedalFunction : std::uint8_t {
  None,
  Coagulate,
  CoagulateMonopolar,
  CoagulateBipolar,
  Cut,
  Irrigate,
  Suck,
  Fire,
  NextTool,
  Clutch,
  CameraFollow,
  CameraIn,
  CameraOut,
  Suspend
};
/// Their words, in the order of PedalFunction.
inline constexpr std::array<std::string_view, 14> kPedalFunctions{
    "none", "coag", "monopolar_coag", "bipolar_coag",  "cut",       "irrigation", "suction",
    "fire", "tool", "clutch",         "camera_follow", "camera_in", "camera_out", "suspend"};
std::optional<PedalFunction> pedalFunctionFromName(std::string_view name);
std::string pedalFunctionNames();  ///< all words, for messages

/// Functions (tools::ToolFunction mask) that a kind of tool takes at all. An endoscope that irrigates rinses
/// its lens.
std::uint32_t functionsOf(tools::ToolKind kind);

/// Bit i: instrument i of tools::Instrument.
using InstrumentMask = std::uint32_t;
inline constexpr InstrumentMask kEveryInstrument = (1u << tools::kInstrumentCount) - 1u;
constexpr InstrumentMask maskOf(tools::Instrument i) {
  return 1u << static_cast<unsigned>(i);
}

/// One switch of a source of input: which button it is, what it does, for whom.
struct Switch {
  int button = 0;  ///< 0 … 31
  PedalFunction function = PedalFunction::None;
  InstrumentMask instruments = kEveryInstrument;
};

/// What the six footswitches of a box are called, and what they do. The driver names its topics by it, the
/// instruments act by it: nothing else says what a pedal means.
struct Footswitches {
  std::array<std::string, 6> names;  ///< of the topics footpedals/NAME
  std::array<PedalFunction, 6> functions{};
};
/// `trainer`: coag, cut, irrigation, suction, tool, clutch. `dvrk`: clutch, camera, cam_minus, cam_plus,
/// bicoag, coag, as a da Vinci Research Kit names its six pedals. Empty where the word is unknown.
std::optional<Footswitches> footswitchPreset(std::string_view name);

/// The switches of one source (footswitches of the box, pedals on USB, a gamepad, buttons of a haptic
/// device): which functions are on. Data older than kStale counts as released; a switch is pressed anew only
/// after a message said that it is up.
class Pedals {
 public:
  static constexpr int kCount = 6;       ///< of the box
  static constexpr int kMost = 32;       ///< of any source
  static constexpr double kStale = 0.1;  ///< s

  /// Six footswitches for every instrument.
  explicit Pedals(const std::array<PedalFunction, kCount>& functions);
  explicit Pedals(std::vector<Switch> switches) : switches_(std::move(switches)) {}

  /// @param mask bit i: button i is down. @param now steady time, s
  void update(std::uint32_t mask, double now);
  /// Mask of tools::ToolFunction for an instrument with this tool at `now`. @param of the instrument's bit
  std::uint32_t active(tools::ToolKind kind, double now, InstrumentMask of = kEveryInstrument) const;
  /// Instruments whose `tool` switch was pressed since the last call; each press counts once.
  InstrumentMask takeToolPress();
  /// Nobody was heard for a while: all is released, and no switch counts as pressed before it was seen up.
  void forget();
  bool stale(double now) const { return last_ < 0.0 || now - last_ > kStale; }

 private:
  std::uint32_t requested(tools::ToolKind kind, double now, InstrumentMask of) const;
  std::vector<Switch> switches_;
  std::uint32_t mask_ = ~0u;  ///< of the last message; before the first, none was seen up
  double last_ = -1.0;
  InstrumentMask tool_press_ = 0;
};

}  // namespace vest::control
