#pragma once

#include <array>
#include <cstddef>

namespace vest::picture {

/// Rendered pixels per pixel of the picture, along an edge, that the automatic quality chooses from.
constexpr std::array<double, 5> kResolutions{1.0, 0.85, 0.7, 0.65, 0.55};

/// The next level of kResolutions after some pictures that took `drawing_ms` each to draw and read back: a
/// level coarser above 32 ms, finer below 14 ms (tuned: 20 pictures a second beside the simulation on two
/// cores; a level changes the pixels by less than 32 / 14, so that it does not go to and fro).
inline std::size_t nextLevel(std::size_t level, double drawing_ms) {
  if (drawing_ms > 32 && level + 1 < kResolutions.size()) return level + 1;
  if (drawing_ms < 14 && level > 0) return level - 1;
  return level;
}

}  // namespace vest::picture
