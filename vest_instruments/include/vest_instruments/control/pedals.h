#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>

#include "vest_instruments/tools/tool_kind.h"

namespace vest::control {

/// What a pedal of the box does.
enum class PedalFunction : std::uint8_t { None, Coagulate, Cut, Irrigate, Suck, Fire, NextTool, Clutch };
/// none, coag, cut, irrigation, suction, fire, tool, clutch.
std::optional<PedalFunction> pedalFunctionFromName(std::string_view name);

/// Functions (tools::ToolFunction mask) that a kind of tool takes at all.
std::uint32_t functionsOf(tools::ToolKind kind);

/// Six footswitches: which functions are on. Data older than kStale counts as released.
class Pedals {
 public:
  static constexpr int kCount = 6;
  static constexpr double kStale = 0.1;  ///< s

  explicit Pedals(const std::array<PedalFunction, kCount>& functions) : functions_(functions) {}

  /// @param mask bit i: pedal i is down. @param now steady time, s
  void update(std::uint32_t mask, double now);
  /// Mask of tools::ToolFunction for an instrument with this tool at `now`.
  std::uint32_t active(tools::ToolKind kind, double now) const;
  bool clutch(double now) const;
  /// True once for each press of a `tool` pedal.
  bool takeToolPress();
  bool stale(double now) const { return last_ < 0.0 || now - last_ > kStale; }

 private:
  std::uint32_t requested(double now) const;
  std::array<PedalFunction, kCount> functions_;
  std::uint32_t mask_ = 0;
  double last_ = -1.0;
  bool tool_press_ = false;
};

}  // namespace vest::control
