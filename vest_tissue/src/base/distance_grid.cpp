#include "vest_tissue/base/distance_grid.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include <Eigen/Geometry>

#include "vest_tissue/base/grid_cost.h"
#include "vest_tissue/base/nearest.h"

namespace vest::contact {
namespace {

using Eigen::Vector3d;
using Triangles = std::vector<std::array<std::uint32_t, 3>>;

/// The box of all triangles with its margin, as grid points.
struct Frame {
  Vector3d low = Vector3d::Zero(), cells = Vector3d::Zero();
  std::array<double, 3> points{};
};

Frame frameOf(const std::vector<Vector3d>& vertices, const Triangles& triangles, double spacing,
              double band) {
  Frame frame;
  Vector3d low = vertices[triangles[0][0]], high = low;
  for (const auto& t : triangles)
    for (const auto v : t) low = low.cwiseMin(vertices[v]), high = high.cwiseMax(vertices[v]);
  low.array() -= band + spacing;
  high.array() += band + spacing;
  frame.low = low, frame.cells = (high - low) / spacing;
  for (int c = 0; c < 3; ++c) frame.points[static_cast<std::size_t>(c)] = std::floor(frame.cells[c]) + 2;
  return frame;
}

/// First and last grid points, along each axis, that a triangle may be near.
struct Reach {
  int from[3], to[3];
  Reach(const std::array<Vector3d, 3>& p, const Frame& frame, double spacing, double band) {
    const Vector3d lo = p[0].cwiseMin(p[1]).cwiseMin(p[2]), hi = p[0].cwiseMax(p[1]).cwiseMax(p[2]);
    for (int c = 0; c < 3; ++c) {
      const int last = static_cast<int>(frame.points[static_cast<std::size_t>(c)]) - 1;
      from[c] = std::clamp(static_cast<int>((lo[c] - band - frame.low[c]) / spacing), 0, last);
      to[c] = std::clamp(static_cast<int>((hi[c] + band - frame.low[c]) / spacing) + 1, 0, last);
    }
  }
  double looks() const {
    return static_cast<double>(to[0] - from[0] + 1) * (to[1] - from[1] + 1) * (to[2] - from[2] + 1);
  }
};

bool tooLarge(const Frame& frame) {
  const auto& n = frame.points;
  return !(n[0] < 4096 && n[1] < 4096 && n[2] < 4096) || n[0] * n[1] * n[2] > double(1 << 26);
}

}  // namespace

GridCost gridCost(const std::vector<Vector3d>& vertices, const Triangles& triangles, double spacing,
                  double band) {
  if (triangles.empty()) return {};
  const Frame frame = frameOf(vertices, triangles, spacing, band);
  GridCost cost{frame.points[0] * frame.points[1] * frame.points[2], 0};
  if (tooLarge(frame)) return cost;
  for (const auto& t : triangles)
    cost.looks += Reach({vertices[t[0]], vertices[t[1]], vertices[t[2]]}, frame, spacing, band).looks();
  return cost;
}

DistanceGrid::DistanceGrid(const std::vector<Eigen::Vector3d>& vertices,
                           const std::vector<std::array<std::uint32_t, 3>>& triangles, double spacing,
                           double band)
    : spacing_(static_cast<float>(spacing)),
      inverse_(static_cast<float>(1.0 / spacing)),
      band_(static_cast<float>(band)) {
  if (triangles.empty()) return;
  const Frame frame = frameOf(vertices, triangles, spacing, band);
  if (tooLarge(frame))
    throw std::invalid_argument(
        "distance grid: more than 2^26 points; the object is too large for its spacing");
  const Vector3d& low = frame.low;
  nx_ = static_cast<int>(frame.points[0]), ny_ = static_cast<int>(frame.points[1]),
  nz_ = static_cast<int>(frame.points[2]);
  origin_ = low.cast<float>();
  const std::size_t points = static_cast<std::size_t>(nx_) * ny_ * nz_;
  std::vector<float> nearest_distance(points, static_cast<float>(band));
  values_.assign(points, 0.0f);

  // Normals of vertices weighted by the angle: their sign is right at edges and corners too.
  std::vector<Vector3d> normal(vertices.size(), Vector3d::Zero());
  for (const auto& t : triangles) {
    const Vector3d face = (vertices[t[1]] - vertices[t[0]]).cross(vertices[t[2]] - vertices[t[0]]);
    if (!(face.norm() > 0)) continue;
    for (int c = 0; c < 3; ++c) {
      const Vector3d u = vertices[t[(c + 1) % 3]] - vertices[t[c]],
                     w = vertices[t[(c + 2) % 3]] - vertices[t[c]];
      const double cosine = std::clamp(u.dot(w) / std::max(u.norm() * w.norm(), 1e-300), -1.0, 1.0);
      normal[t[c]] += face.normalized() * std::acos(cosine);  // loading, not a step
    }
  }
  for (const auto& t : triangles) {
    const std::array<Vector3d, 3> p{vertices[t[0]], vertices[t[1]], vertices[t[2]]};
    const Vector3d face = (p[1] - p[0]).cross(p[2] - p[0]);
    if (!(face.norm() > 0)) continue;
    const Vector3d unit = face.normalized();
    const double edge = std::max((p[1] - p[0]).norm(), (p[2] - p[0]).norm());
    // Of the distance to its plane, by rounding; that of a needle is not known.
    const double slack =
        face.norm() > 1e-6 * edge * edge ? 1e-6 * spacing : std::numeric_limits<double>::infinity();
    const Reach reach(p, frame, spacing, band);
    for (int k = reach.from[2]; k <= reach.to[2]; ++k) {
      for (int j = reach.from[1]; j <= reach.to[1]; ++j) {
        for (int i = reach.from[0]; i <= reach.to[0]; ++i) {
          const Vector3d x = low + spacing * Vector3d(i, j, k);
          const std::size_t at = index(i, j, k);
          // No point of a triangle is nearer than its plane.
          if (std::abs(unit.dot(x - p[0])) > static_cast<double>(nearest_distance[at]) + slack) continue;
          const Nearest n = nearest(x, p);
          if (!(n.distance < nearest_distance[at])) continue;
          const Vector3d q = p[0] * n.weights[0] + p[1] * n.weights[1] + p[2] * n.weights[2];
          const bool inside_face = n.weights[0] > 1e-9 && n.weights[1] > 1e-9 && n.weights[2] > 1e-9;
          const Vector3d outward = inside_face
                                       ? face
                                       : Vector3d(normal[t[0]] * n.weights[0] + normal[t[1]] * n.weights[1] +
                                                  normal[t[2]] * n.weights[2]);
          nearest_distance[at] = static_cast<float>(n.distance);
          values_[at] = static_cast<float>((x - q).dot(outward) >= 0 ? n.distance : -n.distance);
          if (values_[at] == 0.0f) values_[at] = 1e-9f;
        }
      }
    }
  }
  // Beyond the band: the sign of whatever neighbour has one, spread from the band outwards.
  std::vector<std::size_t> front, next;
  for (std::size_t at = 0; at < points; ++at)
    if (values_[at] != 0.0f) front.push_back(at);
  while (!front.empty()) {
    next.clear();
    for (const std::size_t at : front) {
      const int i = static_cast<int>(at % nx_), j = static_cast<int>(at / nx_ % ny_),
                k = static_cast<int>(at / nx_ / ny_);
      const float value = values_[at] > 0 ? static_cast<float>(band) : -static_cast<float>(band);
      const auto visit = [&](int a, int b, int c) {
        if (a < 0 || b < 0 || c < 0 || a >= nx_ || b >= ny_ || c >= nz_) return;
        float& v = values_[index(a, b, c)];
        if (v != 0.0f) return;
        v = value;
        next.push_back(index(a, b, c));
      };
      visit(i - 1, j, k), visit(i + 1, j, k), visit(i, j - 1, k), visit(i, j + 1, k), visit(i, j, k - 1),
          visit(i, j, k + 1);
    }
    front.swap(next);
  }
}

float DistanceGrid::distance(const Eigen::Vector3f& p, Eigen::Vector3f& gradient) const {
  const Eigen::Vector3f g = (p - origin_) * inverse_;
  gradient.setZero();
  if (!(g.minCoeff() >= 0 && g.x() < nx_ - 1 && g.y() < ny_ - 1 && g.z() < nz_ - 1)) return band_;
  const int i = static_cast<int>(g.x()), j = static_cast<int>(g.y()), k = static_cast<int>(g.z());
  const float u = g.x() - i, v = g.y() - j, w = g.z() - k;
  const auto value = [&](int a, int b, int c) { return values_[index(i + a, j + b, k + c)]; };
  const float c00 = value(0, 0, 0) * (1 - u) + value(1, 0, 0) * u,
              c10 = value(0, 1, 0) * (1 - u) + value(1, 1, 0) * u;
  const float c01 = value(0, 0, 1) * (1 - u) + value(1, 0, 1) * u,
              c11 = value(0, 1, 1) * (1 - u) + value(1, 1, 1) * u;
  const float c0 = c00 * (1 - v) + c10 * v, c1 = c01 * (1 - v) + c11 * v;
  const float dx00 = value(1, 0, 0) - value(0, 0, 0), dx10 = value(1, 1, 0) - value(0, 1, 0);
  const float dx01 = value(1, 0, 1) - value(0, 0, 1), dx11 = value(1, 1, 1) - value(0, 1, 1);
  gradient.x() = ((dx00 * (1 - v) + dx10 * v) * (1 - w) + (dx01 * (1 - v) + dx11 * v) * w) * inverse_;
  gradient.y() = ((c10 - c00) * (1 - w) + (c11 - c01) * w) * inverse_;
  gradient.z() = (c1 - c0) * inverse_;
  return c0 * (1 - w) + c1 * w;
}

}  // namespace vest::contact
