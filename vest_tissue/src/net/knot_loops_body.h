// The loops, once for all levels: V is a pack of eight floats with correctly rounded operations. Plain loops
// are what the compiler makes of them. Included by one translation unit per level; not a public header.
#pragma once

#include <algorithm>

#include "vest_tissue/net/knot_loops.h"

namespace vest::net::kernel {

extern const KnotLoops kKnotLoopsBaseline, kKnotLoopsAvx2;

namespace {

void predictRow(const float* x, const float* v, const float* mass, float ahead, float g, float* p, float* f,
                std::size_t n) {
  for (std::size_t i = 0; i < n; ++i) p[i] = x[i] + ahead * v[i];
  for (std::size_t i = 0; i < n; ++i) f[i] = mass[i] * g;
}

void leadRow(const float* x, const float* v, float ahead, float* p, std::size_t n) {
  for (std::size_t i = 0; i < n; ++i) p[i] = x[i] + ahead * v[i];
}

void addScaledRow(const float* g, float s, float* f, std::size_t n) {
  for (std::size_t i = 0; i < n; ++i) f[i] += s * g[i];
}

double sumOf(const float (&lanes)[kLanes], double sum) {
  for (const float lane : lanes) sum += static_cast<double>(lane);
  return sum;
}

template <class V>
double weighedSquaresOf(const float* gx, const float* gy, const float* gz, const float* w, std::size_t n) {
  V lanes = V::broadcast(0.0f);
  std::size_t i = 0;
  for (; i + kLanes <= n; i += kLanes) {
    const V x = V::load(gx + i), y = V::load(gy + i), z = V::load(gz + i);
    lanes = lanes + (x * x + y * y + z * z) * V::load(w + i);
  }
  float of[kLanes];
  lanes.store(of);
  for (; i < n; ++i) of[0] += (gx[i] * gx[i] + gy[i] * gy[i] + gz[i] * gz[i]) * w[i];
  return sumOf(of, 0.0);
}

template <class V>
double alongOf(double sum, const float* g, const float* p, const float* x, std::size_t n) {
  V lanes = V::broadcast(0.0f);
  std::size_t i = 0;
  for (; i + kLanes <= n; i += kLanes) lanes = lanes + V::load(g + i) * (V::load(p + i) - V::load(x + i));
  float of[kLanes];
  lanes.store(of);
  for (; i < n; ++i) of[0] += g[i] * (p[i] - x[i]);
  return sumOf(of, sum);
}

template <class V>
void extentOf(const float* p, std::size_t n, float& low, float& high) {
  V least = V::broadcast(p[0]), most = least;
  std::size_t i = 0;
  for (; i + kLanes <= n; i += kLanes) least = min(V::load(p + i), least), most = max(V::load(p + i), most);
  float of_least[kLanes], of_most[kLanes];
  least.store(of_least), most.store(of_most);
  low = *std::min_element(of_least, of_least + kLanes), high = *std::max_element(of_most, of_most + kLanes);
  for (; i < n; ++i) low = p[i] < low ? p[i] : low, high = p[i] > high ? p[i] : high;
}

template <class V>
float furthestOf(const float* a, const float* b, std::size_t stride, std::size_t n) {
  V lanes = V::broadcast(0.0f);
  std::size_t i = 0;
  for (; i + kLanes <= n; i += kLanes) {
    const V dx = V::load(a + i) - V::load(b + i), dy = V::load(a + stride + i) - V::load(b + stride + i),
            dz = V::load(a + 2 * stride + i) - V::load(b + 2 * stride + i);
    lanes = max(dx * dx + dy * dy + dz * dz, lanes);
  }
  float of[kLanes];
  lanes.store(of);
  for (; i < n; ++i) {
    const float dx = a[i] - b[i], dy = a[stride + i] - b[stride + i],
                dz = a[2 * stride + i] - b[2 * stride + i];
    of[0] = std::max(of[0], dx * dx + dy * dy + dz * dz);
  }
  return *std::max_element(of, of + kLanes);
}

template <class V>
constexpr KnotLoops loopsOf() {
  return {predictRow, leadRow, addScaledRow, weighedSquaresOf<V>, alongOf<V>, extentOf<V>, furthestOf<V>};
}

}  // namespace
}  // namespace vest::net::kernel
