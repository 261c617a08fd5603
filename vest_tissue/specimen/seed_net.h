#pragma once

#include <cmath>
#include <cstdint>
#include <vector>

#include "vest_tissue/net/link_kernel.h"

/// A net of the size of the gynaecology scene: 21 tubes, 2,751 knots, 10,942 springs. For
/// benchmarks and tests of the kernel; the real scene has other shapes and the same counts.
namespace vest::specimen {

struct Tube {
  int rings = 0;   ///< along
  int around = 0;  ///< knots a ring
  std::vector<float> x, y,
      z;  ///< m, numbered along the tube: knot = a·rings + s; kLanes floats of padding behind
  std::vector<net::KernelLink> links;
};

/// @param axial N, of every link; damping N·s/m
inline Tube makeTube(int rings, int around, std::size_t link_count, float axial, float damping,
                     float offset) {
  Tube t;
  t.rings = rings;
  t.around = around;
  const std::size_t n = static_cast<std::size_t>(rings) * around;
  for (auto* v : {&t.x, &t.y, &t.z}) v->assign(n + 2 * net::kLanes, 0.0f);
  const float radius = 0.006f;
  const float pitch = 0.005f;
  for (int a = 0; a < around; ++a) {
    for (int s = 0; s < rings; ++s) {
      const std::size_t i = static_cast<std::size_t>(a) * rings + s;
      const double angle = 2 * M_PI * a / around;
      t.x[i] = offset + pitch * s;
      t.y[i] = radius * static_cast<float>(std::cos(angle));
      t.z[i] = radius * static_cast<float>(std::sin(angle));
    }
  }
  const auto add = [&](std::size_t i, std::size_t j) {
    if (t.links.size() == link_count) return;
    const float dx = t.x[j] - t.x[i], dy = t.y[j] - t.y[i], dz = t.z[j] - t.z[i];
    t.links.push_back({static_cast<std::uint32_t>(i), static_cast<std::uint32_t>(j),
                       std::sqrt(dx * dx + dy * dy + dz * dz), axial, damping});
  };
  const auto knot = [&](int a, int s) { return static_cast<std::size_t>(a % around) * rings + s; };
  for (int a = 0; a < around; ++a)
    for (int s = 0; s < rings; ++s) add(knot(a, s), knot(a + 1, s));  // rings
  for (int a = 0; a < around; ++a)
    for (int s = 0; s + 1 < rings; ++s) add(knot(a, s), knot(a, s + 1));  // along
  for (int a = 0; a < around; ++a)
    for (int s = 0; s + 1 < rings; ++s) add(knot(a, s), knot(a + 1, s + 1));  // diagonals
  for (int a = 0; a < around; ++a)
    for (int s = 0; s + 1 < rings; ++s) add(knot(a + 1, s), knot(a, s + 1));
  for (int a = 0; a < around; ++a)
    for (int s = 0; s + 2 < rings; ++s) add(knot(a, s), knot(a, s + 2));  // bending by second neighbours
  return t;
}

/// The 21 tubes: 7 of the genital organs, 6 arteries, 7 veins, 1 of the intestines.
inline std::vector<Tube> makeSeedNet(float axial, float damping) {
  struct Shape {
    int rings, around;
    std::size_t links;
  };
  // 7 objects: 1,335 knots, 5,030 springs; 6: 594, 2,508; 7: 675, 2,844; 1: 147, 560.
  const Shape shapes[] = {
      {35, 9, 1187}, {25, 9, 848}, {25, 9, 848}, {15, 9, 508}, {15, 9, 508}, {15, 10, 565}, {15, 10, 566},
      {11, 9, 418},  {11, 9, 418}, {11, 9, 418}, {11, 9, 418}, {11, 9, 418}, {11, 9, 418},  {11, 9, 418},
      {11, 9, 418},  {11, 9, 418}, {11, 9, 418}, {11, 9, 418}, {10, 9, 377}, {10, 9, 377},  {21, 7, 560}};
  std::vector<Tube> tubes;
  float offset = 0;
  for (const Shape& s : shapes)
    tubes.push_back(makeTube(s.rings, s.around, s.links, axial, damping, offset += 0.2f));
  return tubes;
}

}  // namespace vest::specimen
