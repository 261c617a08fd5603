#pragma once

#include <algorithm>
#include <cmath>

#include "rods.h"

namespace vest::suture::specimen {

/// Silk, 0, as data/sutures.yaml has it.
inline Section silk() {
  Section s = solidSection(0.0001875, 975, 8.701e9, 0.4);
  s.bend *= 0.05, s.twist *= 0.05;
  s.friction = 0.3, s.strain_damping = 1e-4, s.drag = 1e-4;
  return s;
}

/// An open overhand knot of `segments` segments of `length`, wide open, drawn out by straight tails; a
/// knotted polynomial curve (Shastri 1992).
inline RodDescription overhand(Index segments, double length, double loop) {
  RodDescription rod = straight(segments);
  const auto at = [](double t) {
    return Eigen::Vector3d(t * t * t - 3.0 * t, t * t * t * t - 4.0 * t * t,
                           0.2 * (t * t * t * t * t - 10.0 * t));
  };
  constexpr double kEnd = 2.1;
  constexpr int kFine = 20000;
  double whole = 0.0;
  for (int i = 0; i < kFine; ++i)
    whole += (at(-kEnd + 2.0 * kEnd * (i + 1) / kFine) - at(-kEnd + 2.0 * kEnd * i / kFine)).norm();
  const double scale = loop / whole, tail = 0.5 * (segments * length - loop);
  const auto curve = [&](double t) {
    const double e = std::clamp(t, -kEnd, kEnd);
    return Eigen::Vector3d(scale * at(e));
  };
  // By arc length: tail, knot, tail.
  const Eigen::Vector3d first = curve(-kEnd), last = curve(kEnd);
  const Eigen::Vector3d in = (curve(-kEnd + 1e-4) - first).normalized(),
                        out = (last - curve(kEnd - 1e-4)).normalized();
  double t = -kEnd, s = tail;
  for (Index i = 0; i <= segments; ++i) {
    const double want = i * length;
    if (want < tail) {
      rod.nodes[i] = first - (tail - want) * in;
    } else {
      while (s < want && t < kEnd) {
        const double next = t + 2.0 * kEnd / kFine;
        s += (curve(next) - curve(t)).norm();
        t = next;
      }
      rod.nodes[i] = t < kEnd ? curve(t) : Eigen::Vector3d(last + (want - tail - loop) * out);
    }
  }
  return rod;
}

/// Writhe: Gauss's double sum over pairs of segments (Klenin and Langowski 2000, method 1a). It is continuous
/// as long as nothing passes through itself, and jumps by 2 where something does.
inline double writhe(const std::vector<Eigen::Vector3d>& x) {
  using Eigen::Vector3d;
  double sum = 0.0;
  for (std::size_t i = 0; i + 1 < x.size(); ++i) {
    for (std::size_t j = i + 2; j + 1 < x.size(); ++j) {
      const Vector3d a = x[j] - x[i], b = x[j + 1] - x[i], c = x[j + 1] - x[i + 1], d = x[j] - x[i + 1];
      const Vector3d n[4] = {a.cross(b), b.cross(c), c.cross(d), d.cross(a)};
      double angle = 0.0;
      for (int k = 0; k < 4; ++k) {
        const double size = n[k].norm() * n[(k + 1) % 4].norm();
        if (size > 0.0) angle += std::asin(std::clamp(n[k].dot(n[(k + 1) % 4]) / size, -1.0, 1.0));
      }
      const double side = (x[j + 1] - x[j]).cross(x[i + 1] - x[i]).dot(a);
      sum += (side > 0.0 ? 1.0 : side < 0.0 ? -1.0 : 0.0) * angle;
    }
  }
  return sum / (2.0 * kPi);
}

}  // namespace vest::suture::specimen
