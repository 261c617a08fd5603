// Hinges by eights, once for all levels (see link_kernel_body.h).
#pragma once

#include "link_kernel_body.h"

namespace vest::net::kernel {

template <class V>
struct Vec {
  V x, y, z;
};
template <class V>
inline Vec<V> minus(const Vec<V>& a, const Vec<V>& b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}
template <class V>
inline Vec<V> cross(const Vec<V>& a, const Vec<V>& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
template <class V>
inline V dot(const Vec<V>& a, const Vec<V>& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
template <class V>
inline Vec<V> times(const Vec<V>& a, const V& s) {
  return {a.x * s, a.y * s, a.z * s};
}

template <class V>
void addHinges(const std::vector<Hinge>& hinges, const ElementArrays& a) {
  const V tiny = V::broadcast(1e-30f), one = V::broadcast(1.0f), zero = V::broadcast(0.0f);
  for (std::size_t first = 0; first < hinges.size(); first += kLanes) {
    std::uint32_t index[4][kLanes];
    alignas(32) float stiffness[kLanes], rest[kLanes], least[kLanes];
    for (std::size_t n = 0; n < kLanes; ++n) {
      const bool there = first + n < hinges.size();
      const Hinge& h = hinges[there ? first + n : first];
      index[0][n] = h.edge0, index[1][n] = h.edge1, index[2][n] = h.wing0, index[3][n] = h.wing1;
      stiffness[n] = there ? h.stiffness : 0.0f;
      rest[n] = h.rest;
      least[n] = h.least;
    }
    Vec<V> p[4];
    for (int i = 0; i < 4; ++i)
      p[i] = {V::gather(a.x, index[i]), V::gather(a.y, index[i]), V::gather(a.z, index[i])};
    const Vec<V> edge = minus(p[1], p[0]), w0 = minus(p[2], p[0]), w1 = minus(p[3], p[0]);
    const Vec<V> n0 = cross(edge, w0), n1 = cross(w1, edge);
    const V length2 = max(dot(edge, edge), tiny), length = sqrt(length2);
    const V floor = max(max(V::broadcast(1e-6f) * length2, V::load(least)) * length2, tiny);
    const V own0 = dot(n0, n0), own1 = dot(n1, n1);
    const V area0 = max(own0, floor), area1 = max(own1, floor);
    // Both wings fade alike, by the more crushed one: the moments about the edge stay opposite and equal.
    const V whole = min(own0 / area0, own1 / area1);
    const V product = sqrt(area0 * area1), cosine = dot(n0, n1), sine = dot(cross(n0, n1), edge) / length;
    // tan(theta/2) = sin/(1 + cos); folded further than kGreatestFold it keeps that value.
    const V most = V::broadcast(0.5f * kGreatestFold);
    const V half = max(min(sine / max(product + cosine, V::broadcast(1e-6f) * product), most), zero - most);
    const V fold = half + half;
    const V slope =
        zero - V::broadcast(2.0f) * V::load(stiffness) * (fold - V::load(rest)) * (one + half * half);
    // Gradient of the dihedral angle: each wing turns about the edge, the edge takes what balances it.
    const Vec<V> g0 = times(n0, slope * (zero - length * (whole / max(own0, tiny)))),
                 g1 = times(n1, slope * (zero - length * (whole / max(own1, tiny))));
    const V s0 = dot(w0, edge) / length2, s1 = dot(w1, edge) / length2;
    const Vec<V> b = {zero - (g0.x * s0 + g1.x * s1), zero - (g0.y * s0 + g1.y * s1),
                      zero - (g0.z * s0 + g1.z * s1)};
    const Vec<V> c = {zero - (g0.x + g1.x + b.x), zero - (g0.y + g1.y + b.y), zero - (g0.z + g1.z + b.z)};
    const Vec<V> forces[4] = {c, b, g0, g1};
    alignas(32) float f[4][3][kLanes];
    for (int i = 0; i < 4; ++i)
      forces[i].x.store(f[i][0]), forces[i].y.store(f[i][1]), forces[i].z.store(f[i][2]);
    for (std::size_t n = 0; n < kLanes; ++n) {
      for (int i = 0; i < 4; ++i) {
        const std::uint32_t k = index[i][n];
        a.fx[k] += f[i][0][n];
        a.fy[k] += f[i][1][n];
        a.fz[k] += f[i][2][n];
      }
    }
  }
}

}  // namespace vest::net::kernel
