#include "vest_instruments/control/pedals.h"

#include <cstddef>

namespace vest::control {

using tools::ToolKind;

std::optional<PedalFunction> pedalFunctionFromName(std::string_view name) {
  constexpr std::array<std::string_view, 8> kNames{"none",    "coag", "cut",  "irrigation",
                                                   "suction", "fire", "tool", "clutch"};
  for (std::size_t i = 0; i < kNames.size(); ++i) {
    if (kNames[i] == name) return static_cast<PedalFunction>(i);
  }
  return std::nullopt;
}

std::uint32_t functionsOf(ToolKind kind) {
  switch (kind) {
    case ToolKind::CoagulationHook:
      return tools::kFunctionCut | tools::kFunctionCoagulate;
    case ToolKind::BipolarForceps:
      return tools::kFunctionCoagulate;
    case ToolKind::SuctionIrrigator:
      return tools::kFunctionIrrigate | tools::kFunctionSuck;
    case ToolKind::ClipApplier:
    case ToolKind::InjectionNeedle:
    case ToolKind::SlingApplicator:
      return tools::kFunctionFire;
    default:
      return 0;
  }
}

void Pedals::update(std::uint32_t mask, double now) {
  const std::uint32_t before = stale(now) ? 0 : mask_;
  for (std::size_t i = 0; i < functions_.size(); ++i) {
    const std::uint32_t bit = 1u << i;
    if (functions_[i] == PedalFunction::NextTool && (mask & bit) != 0 && (before & bit) == 0)
      tool_press_ = true;
  }
  mask_ = mask;
  last_ = now;
}

std::uint32_t Pedals::requested(double now) const {
  if (stale(now)) return 0;
  std::uint32_t on = 0;
  for (std::size_t i = 0; i < functions_.size(); ++i) {
    if ((mask_ & (1u << i)) == 0) continue;
    switch (functions_[i]) {
      case PedalFunction::Coagulate:
        on |= tools::kFunctionCoagulate;
        break;
      case PedalFunction::Cut:
        on |= tools::kFunctionCut;
        break;
      case PedalFunction::Irrigate:
        on |= tools::kFunctionIrrigate;
        break;
      case PedalFunction::Suck:
        on |= tools::kFunctionSuck;
        break;
      case PedalFunction::Fire:
        on |= tools::kFunctionFire;
        break;
      case PedalFunction::Clutch:
        on |= tools::kFunctionClutch;
        break;
      case PedalFunction::None:
      case PedalFunction::NextTool:
        break;
    }
  }
  return on;
}

std::uint32_t Pedals::active(ToolKind kind, double now) const {
  const std::uint32_t clutch =
      kind == ToolKind::Endoscope ? 0u : static_cast<std::uint32_t>(tools::kFunctionClutch);
  return requested(now) & (functionsOf(kind) | clutch);
}

bool Pedals::clutch(double now) const {
  return (requested(now) & tools::kFunctionClutch) != 0;
}

bool Pedals::takeToolPress() {
  const bool pressed = tool_press_;
  tool_press_ = false;
  return pressed;
}

}  // namespace vest::control
