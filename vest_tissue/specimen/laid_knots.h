#pragma once

#include <cmath>
#include <vector>

#include "rods.h"

namespace vest::suture::specimen {

/// Points of one strand of a throw, wound along x by half turns: from below at one side to above at the
/// other.
/// @param size m, half the length of the throw @param z m, its height
inline std::vector<Eigen::Vector3d> strandOfThrow(int half_turns, double size, double z, bool from_left) {
  constexpr int kFine = 400;
  const double radius = 0.25 * size;
  std::vector<Eigen::Vector3d> out;
  for (int k = 0; k <= kFine; ++k) {
    const double s = static_cast<double>(k) / kFine, x = from_left ? 2.0 * s - 1.0 : 1.0 - 2.0 * s;
    const double along = from_left ? s : 1.0 - s,
                 angle = (from_left ? -0.5 : 0.5) * kPi + half_turns * kPi * along;
    out.push_back({size * x, radius * std::cos(angle), z + radius * std::sin(angle)});
  }
  return out;
}

/// Points on a path, `spacing` apart along it.
inline std::vector<Eigen::Vector3d> evenly(const std::vector<Eigen::Vector3d>& path, double spacing) {
  std::vector<Eigen::Vector3d> nodes{path.front()};
  double left_over = 0.0;
  for (std::size_t i = 0; i + 1 < path.size(); ++i) {
    const Eigen::Vector3d way = path[i + 1] - path[i];
    const double length = way.norm();
    double at = spacing - left_over;
    for (; at <= length; at += spacing) nodes.push_back(path[i] + at / length * way);
    left_over = length - (at - spacing);
  }
  return nodes;
}

/// A thread that is laid round something and tied over it, loosely: a throw for each number, of as many half
/// turns, right-handed where positive. {3, -3} is a square knot, {3, 3} a granny, {5, -3} a surgeon's knot.
/// The throws lie one above the other (z), each wound along x. @param size m, half the length of a throw
inline std::vector<Eigen::Vector3d> thrown(const std::vector<int>& throws, double size, double tail,
                                           double spacing) {
  using Eigen::Vector3d;
  constexpr int kFine = 400;
  const double height = 1.6 * size;
  // Both strands upwards, by turns from one side; the loop below joins them.
  std::vector<Vector3d> left, right;
  bool from_left = true;
  for (std::size_t n = 0; n < throws.size(); ++n, from_left = !from_left) {
    const double z = height * (static_cast<double>(n) + 1.0);
    for (const Vector3d& x : strandOfThrow(throws[n], size, z, from_left)) left.push_back(x);
    for (const Vector3d& x : strandOfThrow(throws[n], size, z, !from_left)) right.push_back(x);
  }
  std::vector<Vector3d> path(left.rbegin(), left.rend());
  for (int k = 1; k < kFine; ++k) {  // half an ellipse
    const double angle = kPi * (1.0 + static_cast<double>(k) / kFine);
    path.push_back({1.4 * size * std::cos(angle), 0.0, height + 1.2 * height * std::sin(angle)});
  }
  path.insert(path.end(), right.begin(), right.end());
  const auto straightOn = [tail](const Vector3d& end, double side) {
    return Vector3d(end + tail * Vector3d(side, 0.0, 0.35).normalized());
  };
  const double side = from_left ? -1.0 : 1.0;  // where the first strand ends
  path.insert(path.begin(), straightOn(path.front(), side));
  path.push_back(straightOn(path.back(), -side));
  return evenly(path, spacing);
}

}  // namespace vest::suture::specimen
