#pragma once

#include <cstdint>

#include "vest_instruments/tools/tool_kind.h"

namespace vest::interaction {

/// A sucker draws tissue onto its mouth and holds it there by the vacuum over its bore, as long as its valve
/// is down: hold = p·π·d²/4. interaction::Grasp keeps what it holds. All four assumed: wall suction is set to
/// 0 … 80 kPa below the air's pressure, suckers of 5 mm have bores of 3 to 4 mm.
inline constexpr double kSuctionVacuum = 27e3;  ///< Pa: 200 mmHg
inline constexpr double kSuctionBore = 0.0035;  ///< m, diameter
inline constexpr double kSuctionSeal = 0.0005;  ///< m from mouth to tissue at which it is drawn on
inline constexpr double kSuctionGap = 0.0015;   ///< m at which air gets in and it is let go
inline constexpr double kSuctionForce =
    kSuctionVacuum * 0.25 * 3.14159265358979 * kSuctionBore * kSuctionBore;  ///< N

/// A sucker whose suction valve is down. @param functions bit mask of tools::ToolFunction
inline bool draws(tools::ToolKind kind, std::uint32_t functions) {
  return kind == tools::ToolKind::SuctionIrrigator && (functions & tools::kFunctionSuck) != 0;
}

}  // namespace vest::interaction
