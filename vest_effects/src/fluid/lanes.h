#pragma once

#include <cmath>

#if defined(__AVX__)
#include <immintrin.h>
#elif defined(__SSE2__)
#include <emmintrin.h>
#endif

#include "scratch.h"

namespace vest::fluid {
namespace {  // compiled once for each instruction level: nothing of it may be shared between them

constexpr std::size_t kStride = kMostNeighbours + kNeighbourPadding;

/// Eight particles at a time. Sums, products, exact square roots and divisions: the same bits however the
/// compiler builds them.
typedef float Lanes __attribute__((vector_size(32)));
typedef float HalfLanes __attribute__((vector_size(16)));
typedef std::int32_t LaneMask __attribute__((vector_size(32)));

inline Lanes all(float v) {
  return Lanes{v, v, v, v, v, v, v, v};
}
inline HalfLanes load(const Quad& q) {
  return *reinterpret_cast<const HalfLanes*>(q.a);
}
inline Lanes eight(const float* p) {
  Lanes v;
  __builtin_memcpy(&v, p, sizeof v);
  return v;
}

#if defined(__clang__) || __GNUC__ >= 12
/// Lanes of a (0 … 7) and of b (8 … 15).
template <int... kFrom>
inline Lanes mix(Lanes a, Lanes b) {
  return __builtin_shufflevector(a, b, kFrom...);
}
inline Lanes join(HalfLanes a, HalfLanes b) {
  return __builtin_shufflevector(a, b, 0, 1, 2, 3, 4, 5, 6, 7);
}
inline HalfLanes lower(Lanes v) {
  return __builtin_shufflevector(v, v, 0, 1, 2, 3);
}
inline HalfLanes upper(Lanes v) {
  return __builtin_shufflevector(v, v, 4, 5, 6, 7);
}
#else  // GCC 9 to 11, without that function: the same lanes
template <int... kFrom>
inline Lanes mix(Lanes a, Lanes b) {
  return __builtin_shuffle(a, b, LaneMask{kFrom...});
}
inline Lanes join(HalfLanes a, HalfLanes b) {
  return Lanes{a[0], a[1], a[2], a[3], b[0], b[1], b[2], b[3]};
}
inline HalfLanes lower(Lanes v) {
  return HalfLanes{v[0], v[1], v[2], v[3]};
}
inline HalfLanes upper(Lanes v) {
  return HalfLanes{v[4], v[5], v[6], v[7]};
}
#endif

/// Bit k is set where lane k of the mask is.
inline unsigned bits(LaneMask m) {
#if defined(__AVX__)
  return static_cast<unsigned>(_mm256_movemask_ps(reinterpret_cast<__m256>(m)));
#elif defined(__SSE2__)
  const Lanes v = reinterpret_cast<Lanes>(m);
  return static_cast<unsigned>(_mm_movemask_ps(reinterpret_cast<__m128>(lower(v))) |
                               _mm_movemask_ps(reinterpret_cast<__m128>(upper(v))) << 4);
#else
  unsigned b = 0;
  for (unsigned k = 0; k < 8; ++k) b |= (m[k] != 0 ? 1u : 0u) << k;
  return b;
#endif
}
inline Lanes positive(Lanes v) {
  return reinterpret_cast<Lanes>(reinterpret_cast<LaneMask>(v) & (v > all(0.0f)));
}
inline Lanes squareRoot(Lanes v) {
#if defined(__AVX__)
  return reinterpret_cast<Lanes>(_mm256_sqrt_ps(reinterpret_cast<__m256>(v)));
#elif defined(__SSE2__)
  return join(reinterpret_cast<HalfLanes>(_mm_sqrt_ps(reinterpret_cast<__m128>(lower(v)))),
              reinterpret_cast<HalfLanes>(_mm_sqrt_ps(reinterpret_cast<__m128>(upper(v)))));
#else
  Lanes r;
  for (int k = 0; k < 8; ++k) r[k] = std::sqrt(v[k]);
  return r;
#endif
}
inline float sum(Lanes v) {
  return ((v[0] + v[1]) + (v[2] + v[3])) + ((v[4] + v[5]) + (v[6] + v[7]));
}

/// Reads eight quads and turns them: x of all eight, y of all eight …
inline void gather(const Quad* from, const std::uint32_t* index, Lanes& x, Lanes& y, Lanes& z, Lanes& w) {
  const Lanes q0 = join(load(from[index[0]]), load(from[index[4]])),
              q1 = join(load(from[index[1]]), load(from[index[5]])),
              q2 = join(load(from[index[2]]), load(from[index[6]])),
              q3 = join(load(from[index[3]]), load(from[index[7]]));
  const Lanes a = mix<0, 8, 1, 9, 4, 12, 5, 13>(q0, q1), b = mix<0, 8, 1, 9, 4, 12, 5, 13>(q2, q3),
              c = mix<2, 10, 3, 11, 6, 14, 7, 15>(q0, q1), d = mix<2, 10, 3, 11, 6, 14, 7, 15>(q2, q3);
  x = mix<0, 1, 8, 9, 4, 5, 12, 13>(a, b);
  y = mix<2, 3, 10, 11, 6, 7, 14, 15>(a, b);
  z = mix<0, 1, 8, 9, 4, 5, 12, 13>(c, d);
  w = mix<2, 3, 10, 11, 6, 7, 14, 15>(c, d);
}

}  // namespace
}  // namespace vest::fluid
