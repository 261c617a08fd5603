// Links of any topology by eights: per knot, position and velocity lie in one piece of 32 bytes, so that a
// link's end is one load; eight differences become eight lanes in registers, and forces go back the same way.
// The sums are made in the order of addIndexedForces: the same bits. Included only by files built with
// -mavx2.
#pragma once

#include "link_kernel_body.h"
#include "pack_avx2.h"

namespace vest::net::kernel {
namespace {

/// Rows 0 … 3 in each half of the registers become columns, and back.
struct Quads {
  __m256 a, b, c;  ///< first, second, third entries of eight rows, each half on its own
};
inline Quads columns(__m256 r0, __m256 r1, __m256 r2, __m256 r3) {
  const __m256 t0 = _mm256_unpacklo_ps(r0, r1), t1 = _mm256_unpackhi_ps(r0, r1);
  const __m256 t2 = _mm256_unpacklo_ps(r2, r3), t3 = _mm256_unpackhi_ps(r2, r3);
  return {_mm256_shuffle_ps(t0, t2, 0x44), _mm256_shuffle_ps(t0, t2, 0xEE), _mm256_shuffle_ps(t1, t3, 0x44)};
}
struct Rows {
  __m256 r[4];  ///< rows n and n + 4 in the halves; fourth entry 0
};
inline Rows rows(__m256 x, __m256 y, __m256 z) {
  const __m256 zero = _mm256_setzero_ps();
  const __m256 t0 = _mm256_unpacklo_ps(x, y), t1 = _mm256_unpackhi_ps(x, y);
  const __m256 z0 = _mm256_unpacklo_ps(z, zero), z1 = _mm256_unpackhi_ps(z, zero);
  return {{_mm256_shuffle_ps(t0, z0, 0x44), _mm256_shuffle_ps(t0, z0, 0xEE), _mm256_shuffle_ps(t1, z1, 0x44),
           _mm256_shuffle_ps(t1, z1, 0xEE)}};
}

inline void gatherKnots(const KnotArrays& arrays, std::size_t knots, float* motion, float* force) {
  const KnotArrays k = arrays;  // a copy, see addRunForces
  for (std::size_t i = 0; i < knots; i += kLanes) {
    const Rows p = rows(_mm256_loadu_ps(k.x + i), _mm256_loadu_ps(k.y + i), _mm256_loadu_ps(k.z + i));
    const Rows v = rows(_mm256_loadu_ps(k.vx + i), _mm256_loadu_ps(k.vy + i), _mm256_loadu_ps(k.vz + i));
    const Rows f = rows(_mm256_loadu_ps(k.fx + i), _mm256_loadu_ps(k.fy + i), _mm256_loadu_ps(k.fz + i));
    for (std::size_t n = 0; n < 4; ++n) {
      _mm256_storeu_ps(motion + 8 * (i + n), _mm256_permute2f128_ps(p.r[n], v.r[n], 0x20));
      _mm256_storeu_ps(motion + 8 * (i + n + 4), _mm256_permute2f128_ps(p.r[n], v.r[n], 0x31));
      _mm_storeu_ps(force + 4 * (i + n), _mm256_castps256_ps128(f.r[n]));
      _mm_storeu_ps(force + 4 * (i + n + 4), _mm256_extractf128_ps(f.r[n], 1));
    }
  }
}

inline void scatterForces(const KnotArrays& arrays, std::size_t knots, const float* force) {
  const KnotArrays k = arrays;
  for (std::size_t i = 0; i < knots; i += kLanes) {
    __m256 r[4];
    for (std::size_t n = 0; n < 4; ++n)
      r[n] = _mm256_insertf128_ps(_mm256_castps128_ps256(_mm_loadu_ps(force + 4 * (i + n))),
                                  _mm_loadu_ps(force + 4 * (i + n + 4)), 1);
    const Quads f = columns(r[0], r[1], r[2], r[3]);
    _mm256_storeu_ps(k.fx + i, f.a);
    _mm256_storeu_ps(k.fy + i, f.b);
    _mm256_storeu_ps(k.fz + i, f.c);
  }
}

inline void addLane(float* force, std::uint32_t i, std::uint32_t j, __m128 f) {
  float *const at = force + 4 * static_cast<std::size_t>(i), *const to =
                                                                 force + 4 * static_cast<std::size_t>(j);
  _mm_storeu_ps(at, _mm_add_ps(_mm_loadu_ps(at), f));
  _mm_storeu_ps(to, _mm_sub_ps(_mm_loadu_ps(to), f));
}

template <bool kStraight>
inline void addPackedForces(const LinkTable& table, const KnotArrays& k) {
  const LinkTable::LawConstants c = table.law();
  const LinkTable::Block* const blocks = table.blocks().data() + table.firstIndexedBlock();
  const std::size_t knots = (table.indexedKnots() + kLanes - 1) / kLanes * kLanes;
  float* const motion = k.packed;
  float* const force = k.packed + 8 * knots;
  gatherKnots(k, knots, motion, force);
  const std::size_t count = table.indexedBlocks();
  const LinkTable::Indices* const indices = table.indices().data();
  for (std::size_t n = 0; n < count; ++n) {
    const LinkTable::Indices& index = indices[n];
    const auto difference = [&](int lane) {
      return _mm256_sub_ps(_mm256_loadu_ps(motion + 8 * static_cast<std::size_t>(index.knot1[lane])),
                           _mm256_loadu_ps(motion + 8 * static_cast<std::size_t>(index.knot0[lane])));
    };
    const Quads a = columns(difference(0), difference(1), difference(2), difference(3));
    const Quads b = columns(difference(4), difference(5), difference(6), difference(7));
    const auto low = [](__m256 p, __m256 q) { return Pack{_mm256_permute2f128_ps(p, q, 0x20)}; };
    const auto high = [](__m256 p, __m256 q) { return Pack{_mm256_permute2f128_ps(p, q, 0x31)}; };
    const Force<Pack> f =
        linkForce<Pack, kStraight>(blocks[n], c, low(a.a, b.a), low(a.b, b.b), low(a.c, b.c), high(a.a, b.a),
                                   high(a.b, b.b), high(a.c, b.c));
    const Rows r = rows(f.x.v, f.y.v, f.z.v);
    for (int lane = 0; lane < 4; ++lane)
      addLane(force, index.knot0[lane], index.knot1[lane], _mm256_castps256_ps128(r.r[lane]));
    for (int lane = 0; lane < 4; ++lane)
      addLane(force, index.knot0[lane + 4], index.knot1[lane + 4], _mm256_extractf128_ps(r.r[lane], 1));
  }
  scatterForces(k, knots, force);
}

}  // namespace
}  // namespace vest::net::kernel
