#include "vest_instruments/tools/tool_kind.h"

#include <array>
#include <cstddef>

namespace vest::tools {
namespace {

constexpr std::array<std::string_view, kToolKindCount> kToolNames{"none",
                                                                  "grasper",
                                                                  "scissors",
                                                                  "clip_applier",
                                                                  "coagulation_hook",
                                                                  "bipolar_forceps",
                                                                  "needle_holder",
                                                                  "suction_irrigator",
                                                                  "injection_needle",
                                                                  "sling_applicator",
                                                                  "endoscope",
                                                                  "swab"};

constexpr std::array<std::string_view, kInstrumentCount> kInstrumentNames{"left", "right", "third",
                                                                          "endoscope"};

}  // namespace

std::string_view toolName(ToolKind kind) {
  const auto i = static_cast<std::size_t>(kind);
  return i < kToolNames.size() ? kToolNames[i] : kToolNames[0];
}

std::optional<ToolKind> toolFromName(std::string_view name) {
  for (std::size_t i = 0; i < kToolNames.size(); ++i) {
    if (kToolNames[i] == name) return static_cast<ToolKind>(i);
  }
  return std::nullopt;
}

std::string_view instrumentName(Instrument instrument) {
  const auto i = static_cast<std::size_t>(instrument);
  return i < kInstrumentNames.size() ? kInstrumentNames[i] : kInstrumentNames[0];
}

}  // namespace vest::tools
