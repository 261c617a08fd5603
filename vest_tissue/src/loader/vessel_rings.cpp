#include "vessel_rings.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <queue>

#include <Eigen/Geometry>

namespace vest::scene {
namespace {

using Eigen::Vector3d;

constexpr double kApart = 1.5;     // edges between two rings (assumed: each ring then goes all around)
constexpr std::size_t kLeast = 3;  // knots of a ring

struct Surface {
  const std::vector<Vector3d>& nodes;
  std::vector<std::vector<std::uint32_t>> beside;  // per node
  double edge = 0.0;                               // m, mean

  /// Way over the edges from one node; infinite where none leads.
  std::vector<double> waysFrom(std::uint32_t start) const {
    std::vector<double> way(nodes.size(), std::numeric_limits<double>::infinity());
    using At = std::pair<double, std::uint32_t>;
    std::priority_queue<At, std::vector<At>, std::greater<>> next;
    next.push({way[start] = 0.0, start});
    while (!next.empty()) {
      const auto [far, n] = next.top();
      next.pop();
      if (far > way[n]) continue;
      for (const std::uint32_t m : beside[n]) {
        const double through = far + (nodes[m] - nodes[n]).norm();
        if (through < way[m]) next.push({way[m] = through, m});
      }
    }
    return way;
  }
};

/// Around its middle, about an axis.
void order(const std::vector<Vector3d>& nodes, const Vector3d& middle, const Vector3d& axis,
           std::vector<std::uint32_t>& ring) {
  const Vector3d x = axis.unitOrthogonal(), y = axis.cross(x);
  const auto angle = [&](std::uint32_t n) {
    const Vector3d r = nodes[n] - middle;
    return std::atan2(r.dot(y), r.dot(x));
  };
  std::stable_sort(ring.begin(), ring.end(), [&](auto a, auto b) { return angle(a) < angle(b); });
}

}  // namespace

void ringsOfSurface(const std::vector<Vector3d>& nodes,
                    const std::vector<std::array<std::uint32_t, 3>>& triangles, const Vector3d& from,
                    TubeMap& tube) {
  tube.station.clear(), tube.rings.clear();
  Surface surface{nodes, std::vector<std::vector<std::uint32_t>>(nodes.size())};
  for (const auto& t : triangles)
    for (std::size_t e = 0; e < 3; ++e) {
      const std::uint32_t a = t[e], b = t[(e + 1) % 3];
      surface.beside[a].push_back(b), surface.beside[b].push_back(a);
      surface.edge += (nodes[a] - nodes[b]).norm() / (3.0 * static_cast<double>(triangles.size()));
    }
  if (triangles.empty()) return;
  std::uint32_t first = triangles[0][0];
  for (const auto& t : triangles)
    for (const std::uint32_t n : t)
      if ((nodes[n] - from).squaredNorm() < (nodes[first] - from).squaredNorm()) first = n;
  const std::vector<double> to = surface.waysFrom(first);
  std::uint32_t last = first;
  for (std::uint32_t n = 0; n < nodes.size(); ++n)
    if (std::isfinite(to[n]) && to[n] > to[last]) last = n;
  const std::vector<double> back = surface.waysFrom(last);
  const double half = 0.5 * to[last];
  const auto bins = static_cast<std::size_t>(to[last] / (kApart * surface.edge));
  if (bins < 2) return;
  std::vector<std::vector<std::uint32_t>> rings(bins);
  for (std::uint32_t n = 0; n < nodes.size(); ++n) {
    if (!std::isfinite(to[n])) continue;
    const double along = (0.5 * (to[n] - back[n]) + half) / (2.0 * half);
    rings[std::min(bins - 1, static_cast<std::size_t>(std::max(0.0, along) * static_cast<double>(bins)))]
        .push_back(n);
  }
  rings.erase(
      std::remove_if(rings.begin(), rings.end(), [](const auto& ring) { return ring.size() < kLeast; }),
      rings.end());
  std::vector<Vector3d> middle;
  for (const auto& ring : rings) {
    middle.emplace_back(Vector3d::Zero());
    for (const std::uint32_t n : ring) middle.back() += nodes[n] / static_cast<double>(ring.size());
  }
  double station = 0.0;
  for (std::size_t r = 0; r < rings.size() && rings.size() > 1; ++r) {
    if (r > 0) station += (middle[r] - middle[r - 1]).norm();
    const Vector3d axis = middle[std::min(r + 1, rings.size() - 1)] - middle[r > 0 ? r - 1 : 0];
    if (axis.norm() > 1e-12) order(nodes, middle[r], axis.normalized(), rings[r]);
    tube.station.push_back(station);
    tube.rings.push_back(std::move(rings[r]));
  }
}

}  // namespace vest::scene
