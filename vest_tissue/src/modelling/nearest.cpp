#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/Geometry>

#include "vest_tissue/modelling/bake.h"

namespace vest::modelling {
namespace {

std::array<double, 3> closest(const Vector3& p, const Vector3& a, const Vector3& b, const Vector3& c) {
  const Vector3 ab = b - a, ac = c - a, ap = p - a;
  const double d1 = ab.dot(ap), d2 = ac.dot(ap);
  if (d1 <= 0 && d2 <= 0) return {1, 0, 0};
  const Vector3 bp = p - b;
  const double d3 = ab.dot(bp), d4 = ac.dot(bp);
  if (d3 >= 0 && d4 <= d3) return {0, 1, 0};
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) return {1 - d1 / (d1 - d3), d1 / (d1 - d3), 0};
  const Vector3 cp = p - c;
  const double d5 = ab.dot(cp), d6 = ac.dot(cp);
  if (d6 >= 0 && d5 <= d6) return {0, 0, 1};
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) return {1 - d2 / (d2 - d6), 0, d2 / (d2 - d6)};
  const double va = d3 * d6 - d5 * d4;
  if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) {
    const double w = (d4 - d3) / ((d4 - d3) + (d5 - d6));
    return {0, 1 - w, w};
  }
  const double sum = va + vb + vc;
  return {va / sum, vb / sum, vc / sum};
}

double angleAt(const Vector3& a, const Vector3& b, const Vector3& c) {
  const Vector3 u = (b - a).normalized(), v = (c - a).normalized();
  return std::acos(std::clamp(u.dot(v), -1.0, 1.0));
}

}  // namespace

NearestPoints::NearestPoints(const std::vector<Vector3>& points,
                             const std::vector<std::array<std::uint32_t, 3>>& triangles)
    : points_(points), triangles_(triangles), tree_([&] {
        std::vector<contact::Box> boxes;
        for (const auto& t : triangles)
          boxes.push_back({points[t[0]].cwiseMin(points[t[1]]).cwiseMin(points[t[2]]),
                           points[t[0]].cwiseMax(points[t[1]]).cwiseMax(points[t[2]])});
        return boxes;
      }()) {
  begin_.assign(points.size() + 1, 0);
  for (const auto& t : triangles)
    for (const auto k : t) ++begin_[k + 1], rounding_ = std::max(rounding_, points[k].cwiseAbs().maxCoeff());
  for (std::size_t k = 0; k < points.size(); ++k) begin_[k + 1] += begin_[k];
  rounding_ *= 1e-9;
  of_point_.resize(begin_.back());
  std::vector<std::uint32_t> next(begin_.begin(), begin_.end() - 1);
  for (std::uint32_t t = 0; t < triangles.size(); ++t)
    for (const auto k : triangles[t]) of_point_[next[k]++] = t;
}

NearestPoint NearestPoints::operator()(const Vector3& place) const {
  const auto& points = points_;
  const auto& triangles = triangles_;
  NearestPoint best;
  double least = std::numeric_limits<double>::infinity(), nearest_at = least;
  const double rounding = rounding_ + 1e-9 * place.cwiseAbs().maxCoeff();
  const auto bound = [&](const contact::Box& box) { return contact::distanceTo(box, place) - rounding; };
  tree_.visit(bound, nearest_at, [&](std::uint32_t t) {
    const Vector3 &a = points[triangles[t][0]], &b = points[triangles[t][1]], &c = points[triangles[t][2]];
    const auto w = closest(place, a, b, c);
    const Vector3 on = w[0] * a + w[1] * b + w[2] * c;
    const double squared = (place - on).squaredNorm();
    if (!(squared < least || (squared == least && t < best.triangle))) return;
    least = squared, nearest_at = std::sqrt(least);
    best.triangle = t;
    best.weights = w;
    best.point = on;
  });
  // On an edge or corner the nearest face alone may give the wrong side: take all faces that share the point.
  Vector3 normal = Vector3::Zero();
  const auto& nearest = triangles[best.triangle];
  std::vector<std::uint32_t> around;
  for (std::size_t k = 0; k < 3; ++k)
    if (!(best.weights[k] < 1e-9))
      around.insert(around.end(), of_point_.begin() + begin_[nearest[k]],
                    of_point_.begin() + begin_[nearest[k] + 1]);
  std::sort(around.begin(), around.end());
  around.erase(std::unique(around.begin(), around.end()), around.end());
  for (const std::size_t t : around) {
    std::size_t shared = 0, held = 0;
    double weight = 1.0;
    for (int k = 0; k < 3; ++k) {
      if (best.weights[k] < 1e-9) continue;
      ++held;
      for (int j = 0; j < 3; ++j) {
        if (triangles[t][j] != nearest[k]) continue;
        ++shared;
        if (best.weights[k] > 1 - 1e-9) {
          weight = angleAt(points[triangles[t][j]], points[triangles[t][(j + 1) % 3]],
                           points[triangles[t][(j + 2) % 3]]);
        }
      }
    }
    if (shared < held || (held == 3 && t != best.triangle)) continue;
    const Vector3 &a = points[triangles[t][0]], &b = points[triangles[t][1]], &c = points[triangles[t][2]];
    const Vector3 face = (b - a).cross(c - a);
    if (face.norm() > 0) normal += weight * face.normalized();
  }
  best.normal = normal.norm() > 0 ? Vector3(normal.normalized()) : Vector3::UnitZ();
  const double distance = std::sqrt(least);
  best.distance = (place - best.point).dot(best.normal) < 0 ? -distance : distance;
  return best;
}

}  // namespace vest::modelling
