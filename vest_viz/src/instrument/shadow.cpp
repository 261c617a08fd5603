#include "vest_viz/instrument/shadow.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>

namespace vest::instrument {

using Eigen::Vector3d;

CastShadow castShadow(const Vector3d& lamp, const Vector3d& tip, const Vector3d& far, double radius) {
  CastShadow none;
  none.rows.setZero();
  const double length = (far - tip).norm();
  if (!(length > 1e-6) || !(radius > 0) || !lamp.allFinite()) return none;
  const Vector3d along = (far - tip) / length;
  const Vector3d across = tip - lamp - along * (tip - lamp).dot(along);  // from the lamp to the axis
  const double distance = across.norm();
  if (!(distance > 1.5 * radius)) return none;
  const Vector3d out = across / distance, beside = along.cross(out);
  const double end = (tip - lamp).dot(along);
  // The ray to p meets the axis' distance at 1 / c.y of its way, (p - lamp)·along / c.y along it.
  const Vector3d y = out / distance, x = beside / radius, z = (along - end * y) / radius;
  CastShadow shadow;
  for (int i = 0; i < 3; ++i) {
    const Vector3d& row = i == 0 ? x : i == 1 ? y : z;
    shadow.rows.row(i) << row.cast<float>().transpose(), static_cast<float>(-row.dot(lamp));
  }
  return shadow;
}

double shadowAt(const CastShadow& shadow, const Vector3d& p, double radius) {
  const Vector3d c = (shadow.rows * p.cast<float>().homogeneous()).cast<double>();
  if (c.y() <= 1) return 0;
  const double edge = 2 * kLampRadius / radius * std::max(c.y() - 1, 0.02);
  return std::clamp(0.5 + std::min(c.y() - std::fabs(c.x()), c.z()) / edge, 0.0, 1.0);
}

}  // namespace vest::instrument
