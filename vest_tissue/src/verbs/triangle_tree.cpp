#include "triangle_tree.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/Geometry>

#include "vest_tissue/base/nearest.h"

namespace vest::scene {
namespace {

using contact::Box;
using Eigen::Vector3d;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

std::vector<Box> boxesOf(const std::vector<Vector3d>& x,
                         const std::vector<TriangleTree::Triangle>& triangles) {
  std::vector<Box> boxes;
  for (const auto& t : triangles) {
    Box box{x[t[0]].cwiseMin(x[t[1]]).cwiseMin(x[t[2]]), x[t[0]].cwiseMax(x[t[1]]).cwiseMax(x[t[2]])};
    // Beyond the thousandth by which a ray may miss it, and beyond rounding.
    const double more =
        0.01 * (box.high - box.low).norm() + 1e-12 * (box.low.cwiseAbs() + box.high.cwiseAbs()).maxCoeff();
    box.low.array() -= more, box.high.array() += more;
    boxes.push_back(box);
  }
  return boxes;
}

}  // namespace

TriangleTree::TriangleTree(const std::vector<Vector3d>& x, const std::vector<Triangle>& triangles)
    : x_(x), triangles_(triangles), tree_(boxesOf(x, triangles)) {
  for (const auto& t : triangles) {
    const Vector3d &a = x[t[0]], &b = x[t[1]], &c = x[t[2]], centre = (a + b + c) / 3.0;
    centre_.push_back(centre);
    radius_.push_back(std::max({(a - centre).norm(), (b - centre).norm(), (c - centre).norm()}));
  }
}

std::uint32_t TriangleTree::firstBehind(const Vector3d& from, const Vector3d& n, std::uint32_t own) const {
  const double length = n.norm();
  std::uint32_t best = kNoTriangle;
  double least = kInfinity;
  if (!(length > 0.0)) return best;
  const auto bound = [&](const Box& box) {
    const double at = contact::entry(box, from, n);
    return at == kInfinity ? std::numeric_limits<double>::quiet_NaN() : at;  // also where none is found yet
  };
  tree_.visit(bound, least, [&](std::uint32_t i) {
    if (i == own) return;
    const auto& t = triangles_[i];
    const Vector3d &a = x_[t[0]], &b = x_[t[1]], &c = x_[t[2]], face = (b - a).cross(c - a);
    const double down = face.dot(n);
    if (!(down > 0.05 * face.norm() * length)) return;
    const double s = face.dot(a - from) / down;
    if (!(s > 1e-6) || s > least || (s == least && i > best)) return;
    const Vector3d p = from + s * n;
    const double squared = face.squaredNorm();
    if (face.dot((b - p).cross(c - p)) < -1e-3 * squared ||
        face.dot((c - p).cross(a - p)) < -1e-3 * squared || face.dot((a - p).cross(b - p)) < -1e-3 * squared)
      return;
    least = s, best = i;
  });
  return best;
}

bool TriangleTree::looksAgainst(std::uint32_t triangle, const Vector3d& normal) const {
  const auto& t = triangles_[triangle];
  return (x_[t[1]] - x_[t[0]]).cross(x_[t[2]] - x_[t[0]]).dot(normal) < 0.0;
}

double TriangleTree::distance(std::uint32_t triangle, const Vector3d& p) const {
  const auto& t = triangles_[triangle];
  return contact::nearest(p, {x_[t[0]], x_[t[1]], x_[t[2]]}).distance;
}

std::uint32_t TriangleTree::nearest(const Vector3d& p, const Vector3d& normal) const {
  double least = kInfinity;
  std::vector<std::uint32_t> near;
  const auto bound = [&](const Box& box) { return contact::distanceTo(box, p); };
  tree_.visit(bound, least, [&](std::uint32_t i) {
    if ((centre_[i] - p).norm() - radius_[i] > least || looksAgainst(i, normal)) return;
    least = std::min(least, distance(i, p));
    near.push_back(i);
  });
  // In their order, as a walk over all of them: of several at one distance the first.
  std::sort(near.begin(), near.end());
  std::uint32_t best = 0;
  least = kInfinity;
  for (const std::uint32_t i : near) {
    if ((centre_[i] - p).norm() - radius_[i] >= least) continue;
    const double d = distance(i, p);
    if (d < least) least = d, best = i;
  }
  return best;
}

}  // namespace vest::scene
