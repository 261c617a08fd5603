#pragma once

#include <algorithm>

/// What bending and stretching leave of a vessel's lumen.
namespace vest::bleeding {

/// Twice the sine of half the angle by which a vessel turns within a diameter to each side. A kink is a bend
/// that leaves an angle of less than 90 degrees (Wang et al. 2016, BioMed Res. Int., 2428970, who found that
/// pressure is lost the more the sharper it is). Of 30 degrees and less it is shut: the inside of such a bend
/// has no length left, and its wall lies folded on itself (assumed).
constexpr double kKinks = 1.41421356, kFolds = 1.93185165;
/// Share of the lumen above which a narrowing is none: the pulse and a careful hand do as much (assumed).
constexpr double kNarrows = 0.8;

/// Opening 0 shut … 1 open of a vessel that turns. @param turn as kKinks
inline double bent(double turn) {
  return std::clamp((kFolds - turn) / (kFolds - kKinks), 0.0, 1.0);
}

}  // namespace vest::bleeding
