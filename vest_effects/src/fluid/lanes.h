#pragma once

#include <cmath>

#if defined(__SSE2__)
#include <emmintrin.h>
#endif

#include "scratch.h"

namespace vest::fluid {

/// Four particles at a time. Sums, products, exact square roots and divisions: the same bits however the
/// compiler builds them.
typedef float Lanes __attribute__((vector_size(16)));
typedef std::int32_t LaneMask __attribute__((vector_size(16)));

inline Lanes all(float v) {
  return Lanes{v, v, v, v};
}
inline Lanes load(const Quad& q) {
  return *reinterpret_cast<const Lanes*>(q.a);
}
inline Lanes positive(Lanes v) {
  return reinterpret_cast<Lanes>(reinterpret_cast<LaneMask>(v) & (v > all(0.0f)));
}
inline Lanes squareRoot(Lanes v) {
#if defined(__SSE2__)
  return reinterpret_cast<Lanes>(_mm_sqrt_ps(reinterpret_cast<__m128>(v)));
#else
  return Lanes{std::sqrt(v[0]), std::sqrt(v[1]), std::sqrt(v[2]), std::sqrt(v[3])};
#endif
}
inline float sum(Lanes v) {
  return (v[0] + v[1]) + (v[2] + v[3]);
}

/// Reads four quads and turns them: x of all four, y of all four …
inline void gather(const Quad* from, const std::uint32_t* index, Lanes& x, Lanes& y, Lanes& z, Lanes& w) {
  const Lanes q0 = load(from[index[0]]), q1 = load(from[index[1]]), q2 = load(from[index[2]]),
              q3 = load(from[index[3]]);
  const Lanes a = __builtin_shufflevector(q0, q1, 0, 4, 1, 5),
              b = __builtin_shufflevector(q2, q3, 0, 4, 1, 5),
              c = __builtin_shufflevector(q0, q1, 2, 6, 3, 7),
              d = __builtin_shufflevector(q2, q3, 2, 6, 3, 7);
  x = __builtin_shufflevector(a, b, 0, 1, 4, 5);
  y = __builtin_shufflevector(a, b, 2, 3, 6, 7);
  z = __builtin_shufflevector(c, d, 0, 1, 4, 5);
  w = __builtin_shufflevector(c, d, 2, 3, 6, 7);
}

}  // namespace vest::fluid
