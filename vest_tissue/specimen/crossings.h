#pragma once

#include <cmath>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace vest::suture::specimen {

/// How often segments went through each other as the nodes of threads moved straight from `was` to `now`:
/// four points in one plane, and the two segments cross in it. There and back counts nothing, as half of the
/// change of writhe. It knows nothing of contacts. @param starts first nodes of threads after the first one
/// @param all  gets their number, there and back counted twice
inline int crossings(const std::vector<Eigen::Vector3d>& was, const std::vector<Eigen::Vector3d>& now,
                     const std::vector<std::size_t>& starts = {}, int* all = nullptr) {
  using Eigen::Vector3d;
  const auto joins = [&](std::size_t i) {  // no segment from i to i + 1
    for (const std::size_t s : starts)
      if (i + 1 == s) return true;
    return false;
  };
  int found = 0;
  std::vector<Vector3d> low(was.size()), high(was.size());
  for (std::size_t i = 0; i + 1 < was.size(); ++i) {
    low[i] = was[i].cwiseMin(was[i + 1]).cwiseMin(now[i]).cwiseMin(now[i + 1]);
    high[i] = was[i].cwiseMax(was[i + 1]).cwiseMax(now[i]).cwiseMax(now[i + 1]);
  }
  for (std::size_t i = 0; i + 1 < was.size(); ++i) {
    for (std::size_t j = i + 2; j + 1 < was.size(); ++j) {
      if (joins(i) || joins(j) || (low[i].array() > high[j].array()).any() ||
          (low[j].array() > high[i].array()).any())
        continue;
      const auto at = [&](std::size_t k, double t) { return Vector3d(was[k] + t * (now[k] - was[k])); };
      const auto volume = [&](double t) {
        const Vector3d p = at(i, t);
        return (at(i + 1, t) - p).cross(at(j + 1, t) - at(j, t)).dot(at(j, t) - p);
      };
      constexpr int kParts = 32;
      double before = volume(0.0);
      for (int n = 1; n <= kParts; ++n) {
        const double after = volume(static_cast<double>(n) / kParts);
        if ((before > 0.0) == (after > 0.0)) continue;
        double a = static_cast<double>(n - 1) / kParts, b = static_cast<double>(n) / kParts;
        for (int k = 0; k < 50; ++k) {
          const double c = 0.5 * (a + b);
          ((volume(c) > 0.0) == (before > 0.0) ? a : b) = c;
        }
        const int sign = after > before ? 1 : -1;
        before = after;
        // In their plane: p + s·u = q + v·w.
        const Vector3d p = at(i, b), u = at(i + 1, b) - p, q = at(j, b), v = at(j + 1, b) - q, m = u.cross(v);
        const double size = m.squaredNorm();
        if (!(size > 1e-12 * u.squaredNorm() * v.squaredNorm())) continue;
        const double s = (q - p).cross(v).dot(m) / size, t = (q - p).cross(u).dot(m) / size;
        if (!(s >= 0.0 && s <= 1.0 && t >= 0.0 && t <= 1.0)) continue;
        found += sign;
        if (all != nullptr) ++*all;
      }
    }
  }
  return found;
}

}  // namespace vest::suture::specimen
