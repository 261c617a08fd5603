#pragma once

#include <algorithm>
#include <array>

#include "../scene/stages.h"

namespace vest::scene {

constexpr double kClose = 0.001;    ///< m: contacts are prepared this much before they touch
constexpr double kRounding = 1e-6;  ///< m: far more than single precision loses in a box of 1 m

/// Squared distance, m², of a point from the box of a triangle, never more than that from the triangle:
/// spares the exact one.
inline double toBoxSquared(const Eigen::Vector3d& x, const std::array<Eigen::Vector3d, 3>& p) {
  double squared = 0.0;
  for (int e = 0; e < 3; ++e) {
    const double low = std::min(std::min(p[0][e], p[1][e]), p[2][e]),
                 high = std::max(std::max(p[0][e], p[1][e]), p[2][e]);
    const double off = std::max(std::max(low - x[e], x[e] - high), 0.0);
    squared += off * off;
  }
  return squared;
}

/// Way at which a pair that is `distance` apart now can touch within `reach` at the earliest.
inline double clearUntil(const ObjectState& a, const ObjectState& b, double distance, double reach) {
  return a.way + b.way + (distance - reach) - kRounding;
}

/// An edge of the contact surface as it is now.
struct EdgeNow {
  std::array<std::uint32_t, 2> knots;
  Eigen::Vector3d from, to;  ///< m
  EdgeNow(const ObjectState& s, const SurfaceEdge& e)
      : knots{s.triangles[e.triangle][e.corner], s.triangles[e.triangle][(e.corner + 1) % 3]},
        from(knotPosition(s, knots[0])),
        to(knotPosition(s, knots[1])) {}
};

}  // namespace vest::scene
