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
      return tools::kFunctionCoagulate | tools::kFunctionSuspend;
    case ToolKind::Grasper:
    case ToolKind::NeedleHolder:
      return tools::kFunctionSuspend;
    case ToolKind::SuctionIrrigator:
      return tools::kFunctionIrrigate | tools::kFunctionSuck;
    case ToolKind::ClipApplier:
    case ToolKind::InjectionNeedle:
    case ToolKind::SlingApplicator:
      return tools::kFunctionFire;
    case ToolKind::Endoscope:
      return tools::kFunctionIrrigate | tools::kFunctionCameraFollow | tools::kFunctionCameraIn |
             tools::kFunctionCameraOut;
    default:
      return 0;
  }
}

std::string pedalFunctionNames() {
  std::string all;
  for (const std::string_view word : kPedalFunctions) all.append(all.empty() ? "" : ", ").append(word);
  return all;
}

std::optional<Footswitches> footswitchPreset(std::string_view name) {
  using F = PedalFunction;
  if (name == "trainer") {
    return Footswitches{{"coag", "cut", "irrigation", "suction", "tool", "clutch"},
                        {F::Coagulate, F::Cut, F::Irrigate, F::Suck, F::NextTool, F::Clutch}};
  }
  if (name == "dvrk") {
    return Footswitches{
        {"clutch", "camera", "cam_minus", "cam_plus", "bicoag", "coag"},
        {F::Clutch, F::CameraFollow, F::CameraOut, F::CameraIn, F::CoagulateBipolar, F::CoagulateMonopolar}};
  }
  return std::nullopt;
}

Pedals::Pedals(const std::array<PedalFunction, kCount>& functions) {
  for (int i = 0; i < kCount; ++i)
    switches_.push_back({i, functions[static_cast<std::size_t>(i)], kEveryInstrument});
}

void Pedals::update(std::uint32_t mask, double now) {
  // A gap in the messages is no release: one press hands over one tool, however late the next message comes.
  const std::uint32_t pressed = mask & ~mask_;
  for (const Switch& s : switches_) {
    if (s.function == PedalFunction::NextTool && (pressed >> s.button & 1u) != 0)
      tool_press_ |= s.instruments;
  }
  mask_ = mask;
  last_ = now;
}

void Pedals::forget() {
  mask_ = ~0u;
  last_ = -1.0;
}

std::uint32_t Pedals::requested(ToolKind kind, double now, InstrumentMask of) const {
  if (stale(now)) return 0;
  std::uint32_t on = 0;
  for (const Switch& s : switches_) {
    if ((mask_ & (1u << s.button)) == 0 || (s.instruments & of) == 0) continue;
    switch (s.function) {
      case PedalFunction::Coagulate:
        on |= tools::kFunctionCoagulate;
        break;
      case PedalFunction::CoagulateMonopolar:
        if (kind == ToolKind::CoagulationHook) on |= tools::kFunctionCoagulate;
        break;
      case PedalFunction::CoagulateBipolar:
        if (kind == ToolKind::BipolarForceps) on |= tools::kFunctionCoagulate;
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
      case PedalFunction::CameraFollow:
        on |= tools::kFunctionCameraFollow;
        break;
      case PedalFunction::CameraIn:
        on |= tools::kFunctionCameraIn;
        break;
      case PedalFunction::CameraOut:
        on |= tools::kFunctionCameraOut;
        break;
      case PedalFunction::Suspend:
        on |= tools::kFunctionSuspend;
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
  return requested(kind, now, of) & (functionsOf(kind) | clutch);
}

InstrumentMask Pedals::takeToolPress() {
  return std::exchange(tool_press_, 0u);
}

}  // namespace vest::control
