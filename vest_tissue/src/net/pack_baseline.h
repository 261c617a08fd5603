#pragma once

// Portable level. In an unnamed namespace: each level's code stays in its own file.
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "vest_tissue/net/link_kernel.h"

namespace vest::net::kernel {
namespace {

/// Eight floats in portable C++; the compiler turns the loops into whatever the base architecture has.
struct Pack {
  float v[kLanes];
  static Pack broadcast(float a) {
    Pack r;
    for (float& e : r.v) e = a;
    return r;
  }
  static Pack load(const float* p) {
    Pack r;
    for (std::size_t n = 0; n < kLanes; ++n) r.v[n] = p[n];
    return r;
  }
  static Pack gather(const float* p, const std::uint32_t* index) {
    Pack r;
    for (std::size_t n = 0; n < kLanes; ++n) r.v[n] = p[index[n]];
    return r;
  }
  void store(float* p) const {
    for (std::size_t n = 0; n < kLanes; ++n) p[n] = v[n];
  }
};

#define VEST_LANES(EXPRESSION)                                  \
  Pack r;                                                       \
  for (std::size_t n = 0; n < kLanes; ++n) r.v[n] = EXPRESSION; \
  return r
inline Pack operator+(const Pack& a, const Pack& b) {
  VEST_LANES(a.v[n] + b.v[n]);
}
inline Pack operator-(const Pack& a, const Pack& b) {
  VEST_LANES(a.v[n] - b.v[n]);
}
inline Pack operator*(const Pack& a, const Pack& b) {
  VEST_LANES(a.v[n] * b.v[n]);
}
inline Pack operator/(const Pack& a, const Pack& b) {
  VEST_LANES(a.v[n] / b.v[n]);
}
// As the processor's max and min: the second operand where the comparison is false (NaN, equal zeros).
inline Pack max(const Pack& a, const Pack& b) {
  VEST_LANES(a.v[n] > b.v[n] ? a.v[n] : b.v[n]);
}
inline Pack min(const Pack& a, const Pack& b) {
  VEST_LANES(a.v[n] < b.v[n] ? a.v[n] : b.v[n]);
}
inline Pack sqrt(const Pack& a) {
  VEST_LANES(std::sqrt(a.v[n]));
}
#undef VEST_LANES

}  // namespace
}  // namespace vest::net::kernel
