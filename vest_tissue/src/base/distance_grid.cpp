#include "vest_tissue/base/distance_grid.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <Eigen/Geometry>

#include "vest_tissue/base/nearest.h"

namespace vest::contact {
namespace {

constexpr std::size_t kMostWork = 1000000000;  // distances to triangles: a minute (assumed)

}  // namespace

DistanceGrid::DistanceGrid(const std::vector<Eigen::Vector3d>& vertices,
                           const std::vector<std::array<std::uint32_t, 3>>& triangles, double spacing,
                           double band)
    : spacing_(static_cast<float>(spacing)),
      inverse_(static_cast<float>(1.0 / spacing)),
      band_(static_cast<float>(band)) {
  using Eigen::Vector3d;
  if (triangles.empty()) return;
  Vector3d low = vertices[triangles[0][0]], high = low;
  for (const auto& t : triangles)
    for (const auto v : t) low = low.cwiseMin(vertices[v]), high = high.cwiseMax(vertices[v]);
  low.array() -= band + spacing;
  high.array() += band + spacing;
  const Vector3d cells = (high - low) / spacing;
  if (!(cells.x() + 2 < 4096 && cells.y() + 2 < 4096 && cells.z() + 2 < 4096) ||
      (cells.x() + 2) * (cells.y() + 2) * (cells.z() + 2) > double(1 << 26)) {
    throw std::invalid_argument(
        "distance grid: more than 2^26 points; the object is too large for its spacing");
  }
  nx_ = static_cast<int>(cells.x()) + 2, ny_ = static_cast<int>(cells.y()) + 2,
  nz_ = static_cast<int>(cells.z()) + 2;
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
  std::size_t work = 0;
  for (const auto& t : triangles) {
    const std::array<Vector3d, 3> p{vertices[t[0]], vertices[t[1]], vertices[t[2]]};
    const Vector3d face = (p[1] - p[0]).cross(p[2] - p[0]);
    if (!(face.norm() > 0)) continue;
    const Vector3d lo = p[0].cwiseMin(p[1]).cwiseMin(p[2]), hi = p[0].cwiseMax(p[1]).cwiseMax(p[2]);
    int from[3], to[3];
    const int limit[3] = {nx_ - 1, ny_ - 1, nz_ - 1};
    for (int c = 0; c < 3; ++c) {
      from[c] = std::clamp(static_cast<int>((lo[c] - band - low[c]) / spacing), 0, limit[c]);
      to[c] = std::clamp(static_cast<int>((hi[c] + band - low[c]) / spacing) + 1, 0, limit[c]);
    }
    work += static_cast<std::size_t>(to[0] - from[0] + 1) * static_cast<std::size_t>(to[1] - from[1] + 1) *
            static_cast<std::size_t>(to[2] - from[2] + 1);
    if (work > kMostWork)
      throw std::invalid_argument(
          "distance grid: its triangles cover too many points one after another; fewer large ones are "
          "allowed");
    for (int k = from[2]; k <= to[2]; ++k) {
      for (int j = from[1]; j <= to[1]; ++j) {
        for (int i = from[0]; i <= to[0]; ++i) {
          const Vector3d x = low + spacing * Vector3d(i, j, k);
          const Nearest n = nearest(x, p);
          const std::size_t at = index(i, j, k);
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
