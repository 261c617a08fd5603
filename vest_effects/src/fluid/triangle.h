#pragma once

#include <cmath>

namespace vest::fluid {
namespace {  // compiled once for each instruction level: nothing of it may be shared between them

struct V3 {
  float x, y, z;
};
inline V3 operator-(V3 a, V3 b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}
inline V3 operator+(V3 a, V3 b) {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}
inline V3 operator*(float s, V3 a) {
  return {s * a.x, s * a.y, s * a.z};
}
inline float dot(V3 a, V3 b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
inline V3 cross(V3 a, V3 b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
inline float length(V3 a) {
  return std::sqrt(dot(a, a));
}
inline V3 at(const float* p) {
  return {p[0], p[1], p[2]};
}
inline void put(V3 a, float* p) {
  p[0] = a.x, p[1] = a.y, p[2] = a.z;
}

/// Nearest point of a triangle by the regions of its corners and edges. @return true: inside the face
inline bool nearestWeights(V3 p, V3 a, V3 b, V3 c, float w[3]) {
  const V3 ab = b - a, ac = c - a, ap = p - a;
  const float d1 = dot(ab, ap), d2 = dot(ac, ap);
  if (d1 <= 0 && d2 <= 0) return w[0] = 1, w[1] = 0, w[2] = 0, false;
  const V3 bp = p - b;
  const float d3 = dot(ab, bp), d4 = dot(ac, bp);
  if (d3 >= 0 && d4 <= d3) return w[0] = 0, w[1] = 1, w[2] = 0, false;
  const float vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) {
    const float t = d1 - d3 > 0 ? d1 / (d1 - d3) : 0;
    return w[0] = 1 - t, w[1] = t, w[2] = 0, false;
  }
  const V3 cp = p - c;
  const float d5 = dot(ab, cp), d6 = dot(ac, cp);
  if (d6 >= 0 && d5 <= d6) return w[0] = 0, w[1] = 0, w[2] = 1, false;
  const float vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) {
    const float t = d2 - d6 > 0 ? d2 / (d2 - d6) : 0;
    return w[0] = 1 - t, w[1] = 0, w[2] = t, false;
  }
  const float va = d3 * d6 - d5 * d4;
  if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) {
    const float s = (d4 - d3) + (d5 - d6), t = s > 0 ? (d4 - d3) / s : 0;
    return w[0] = 0, w[1] = 1 - t, w[2] = t, false;
  }
  const float s = va + vb + vc;
  if (!(s > 0)) return w[0] = w[1] = w[2] = 1.0f / 3, false;
  w[1] = vb / s, w[2] = vc / s, w[0] = 1 - w[1] - w[2];
  return true;
}

}  // namespace
}  // namespace vest::fluid
