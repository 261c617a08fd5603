#include "vest_instruments/control/pedals.h"

#include <cstddef>

namespace vest::control {

using tools::ToolKind;

std::optional<PedalFunction> pedalFunctionFromName(std::string_view name) {
  for (std::size_t i = 0; i < kPedalFunctions.size(); ++i) {
    if (kPedalFunctions[i] == name) return static_cast<PedalFunction>(i);
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

Pedals::Pedals(const std::array<PedalFunction, kCount>& functions) {
  for (int i = 0; i < kCount; ++i)
    switches_.push_back({i, functions[static_cast<std::size_t>(i)], kEveryInstrument});
}

void Pedals::update(std::uint32_t mask, double now) {
  const std::uint32_t before = stale(now) ? 0 : mask_;
  for (const Switch& s : switches_) {
    const std::uint32_t bit = 1u << s.button;
    if (s.function == PedalFunction::NextTool && (mask & bit) != 0 && (before & bit) == 0)
      tool_press_ |= s.instruments;
  }
  mask_ = mask;
  last_ = now;
}

std::uint32_t Pedals::requested(double now, InstrumentMask of) const {
  if (stale(now)) return 0;
  std::uint32_t on = 0;
  for (const Switch& s : switches_) {
    if ((mask_ & (1u << s.button)) == 0 || (s.instruments & of) == 0) continue;
    switch (s.function) {
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

std::uint32_t Pedals::active(ToolKind kind, double now, InstrumentMask of) const {
  const std::uint32_t clutch =
      kind == ToolKind::Endoscope ? 0u : static_cast<std::uint32_t>(tools::kFunctionClutch);
  return requested(now, of) & (functionsOf(kind) | clutch);
}

bool Pedals::clutch(double now, InstrumentMask of) const {
  return (requested(now, of) & tools::kFunctionClutch) != 0;
}

InstrumentMask Pedals::takeToolPress() {
  return std::exchange(tool_press_, 0u);
}

}  // namespace vest::control
