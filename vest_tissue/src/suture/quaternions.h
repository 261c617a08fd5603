#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "vest_tissue/base/elementary.h"

/// Rotations without trigonometry of libm.
namespace vest::suture {

inline Eigen::Matrix3d skew(const Eigen::Vector3d& v) {
  Eigen::Matrix3d m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

/// Half of a rotation of less than 180°.
inline Eigen::Quaterniond half(const Eigen::Quaterniond& p) {
  const double sign = p.w() < 0.0 ? -1.0 : 1.0;
  return Eigen::Quaterniond(1.0 + sign * p.w(), sign * p.x(), sign * p.y(), sign * p.z()).normalized();
}

/// Turns the direction t into u, both of length 1 and not opposite, the shortest way.
inline Eigen::Quaterniond turnOf(const Eigen::Vector3d& t, const Eigen::Vector3d& u) {
  const Eigen::Vector3d c = t.cross(u);
  return Eigen::Quaterniond(1.0 + t.dot(u), c.x(), c.y(), c.z()).normalized();
}

/// About the third axis.
inline Eigen::Quaterniond about(double angle) {
  const double turns = angle * 0.15915494309189535 * 0.5;
  return Eigen::Quaterniond(base::sineOfTurns(turns + 0.25), 0.0, 0.0, base::sineOfTurns(turns));
}

/// Applies a small rotation θ given in the frame's own axes: q·(1, θ/2), normalised.
inline Eigen::Quaterniond turned(const Eigen::Quaterniond& q, const Eigen::Vector3d& theta) {
  return (q * Eigen::Quaterniond(1.0, 0.5 * theta.x(), 0.5 * theta.y(), 0.5 * theta.z())).normalized();
}

}  // namespace vest::suture
