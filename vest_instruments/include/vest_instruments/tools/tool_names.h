#pragma once

#include <string>

#include "vest_instruments/tools/tool_kind.h"

namespace vest::tools {

/// The tools that a hand can hold, for refusals: "none, grasper, …", or with their numbers "0 none, 1
/// grasper, …".
inline std::string handTools(bool numbers = false) {
  std::string out;
  for (int i = 0; i < kToolKindCount; ++i) {
    const auto kind = static_cast<ToolKind>(i);
    if (kind == ToolKind::Endoscope) continue;
    out += (out.empty() ? "" : ", ") + (numbers ? std::to_string(i) + " " : "") + std::string(toolName(kind));
  }
  return out;
}

}  // namespace vest::tools
