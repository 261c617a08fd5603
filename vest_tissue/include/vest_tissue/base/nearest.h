#pragma once

#include <array>

#include <Eigen/Core>

namespace vest::contact {

/// Nearest points of the segment a…b and the triangle p: parameter on the segment, barycentric on the
/// triangle.
struct Nearest {
  double distance;
  double s;  ///< on a…b, 0 … 1
  std::array<double, 3> weights;
};
Nearest nearest(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const std::array<Eigen::Vector3d, 3>& p);
/// Nearest point of a triangle to a point.
Nearest nearest(const Eigen::Vector3d& point, const std::array<Eigen::Vector3d, 3>& p);
/// Nearest points of the segments a…b and c…d, 0 <= s, t <= 1. @return their distance, m
double nearestSegments(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c,
                       const Eigen::Vector3d& d, double& s, double& t);

}  // namespace vest::contact
