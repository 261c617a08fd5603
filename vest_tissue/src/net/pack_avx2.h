#pragma once

// Included only by files built with -mavx2. In an unnamed namespace: each level's code stays in its own file.
#include <immintrin.h>

#include <cstdint>

#include "vest_tissue/net/link_kernel.h"

namespace vest::net::kernel {
namespace {

struct Pack {
  __m256 v;
  static Pack broadcast(float a) { return {_mm256_set1_ps(a)}; }
  static Pack load(const float* p) { return {_mm256_loadu_ps(p)}; }
  static Pack gather(const float* p, const std::uint32_t* i) {
    // Eight loads are as fast as the gather instruction on most processors, and faster on some.
    return {_mm256_setr_ps(p[i[0]], p[i[1]], p[i[2]], p[i[3]], p[i[4]], p[i[5]], p[i[6]], p[i[7]])};
  }
  void store(float* p) const { _mm256_storeu_ps(p, v); }
};

inline Pack operator+(Pack a, Pack b) {
  return {_mm256_add_ps(a.v, b.v)};
}
inline Pack operator-(Pack a, Pack b) {
  return {_mm256_sub_ps(a.v, b.v)};
}
inline Pack operator*(Pack a, Pack b) {
  return {_mm256_mul_ps(a.v, b.v)};
}
inline Pack operator/(Pack a, Pack b) {
  return {_mm256_div_ps(a.v, b.v)};
}
inline Pack max(Pack a, Pack b) {
  return {_mm256_max_ps(a.v, b.v)};
}
inline Pack min(Pack a, Pack b) {
  return {_mm256_min_ps(a.v, b.v)};
}
inline Pack sqrt(Pack a) {
  return {_mm256_sqrt_ps(a.v)};
}

}  // namespace
}  // namespace vest::net::kernel
