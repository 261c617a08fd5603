#pragma once

#include <cstdint>

namespace vest::texture {

/// Sum of `octaves` of Perlin noise that repeats every 1 in u and v; about -1 … 1.
/// @param fu, fv waves per tile of the first octave, ≥ 1
float periodicFbm(float u, float v, int fu, int fv, int octaves, std::uint32_t seed);
/// The same with the absolute value of each octave: turbulence, 0 … about 1.
float periodicTurbulence(float u, float v, int fu, int fv, int octaves, std::uint32_t seed);

/// Distances to the nearest and second nearest of jittered points, one per cell, `cells` per tile (Worley
/// 1996).
struct Cell {
  float nearest, second;  ///< in cells
  std::uint32_t id;
};
Cell periodicCell(float u, float v, int cells, std::uint32_t seed);

/// Small counter-based generator: the same numbers on every machine.
class Random {
 public:
  explicit Random(std::uint32_t seed) : state_(seed * 2654435761u + 88172645u) {}
  std::uint32_t next();
  float uniform() { return static_cast<float>(next() >> 8) * (1.0f / 16777216.0f); }
  float centred() { return uniform() + uniform() + uniform() - 1.5f; }  ///< about normal, deviation 0.5

 private:
  std::uint32_t state_;
};

}  // namespace vest::texture
