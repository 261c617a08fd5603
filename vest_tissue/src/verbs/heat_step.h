/// How often heat moves.
#pragma once

namespace vest::scene {

/// s: steps of what heat does. The thinnest layer follows the next one in (0.4 mm)² / 0.14 mm²/s = 1 s.
inline constexpr double kHeatStep = 0.008;

}  // namespace vest::scene
