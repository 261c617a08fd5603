#pragma once

#include <cstddef>

#include "vest_tissue/net/link_kernel.h"

namespace vest::net {

/// Loops over rows of knots that a step runs between its kernels, compiled once for each level of the
/// processor with the same bits: sums and extremes go by eight lanes in a fixed order. Rows have n entries.
/// Real-time safe.
struct KnotLoops {
  /// p = x + ahead·v (m, m/s, s); f = mass·g (N, kg, m/s²).
  void (*predict)(const float* x, const float* v, const float* mass, float ahead, float g, float* p, float* f,
                  std::size_t n);
  /// p = x + ahead·v.
  void (*lead)(const float* x, const float* v, float ahead, float* p, std::size_t n);
  /// f += s·g.
  void (*addScaled)(const float* g, float s, float* f, std::size_t n);
  /// Sum of (gx² + gy² + gz²)·w.
  double (*weighedSquares)(const float* gx, const float* gy, const float* gz, const float* w, std::size_t n);
  /// `sum` and that of g·(p − x), of each lane in single precision.
  double (*along)(double sum, const float* g, const float* p, const float* x, std::size_t n);
  /// Least and greatest of p; n > 0.
  void (*extent)(const float* p, std::size_t n, float& low, float& high);
  /// Greatest of |a − b|², m², a and b three rows that lie `stride` apart.
  float (*furthest)(const float* a, const float* b, std::size_t stride, std::size_t n);
};

const KnotLoops& knotLoops(KernelLevel level);

}  // namespace vest::net
