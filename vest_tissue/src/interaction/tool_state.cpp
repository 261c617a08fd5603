#include "vest_tissue/interaction/tool_state.h"

#include <algorithm>
#include <cmath>

namespace vest::interaction {

using Eigen::Quaterniond;
using Eigen::Vector3d;

Quaterniond throughPivot(const Quaterniond& orientation, const Vector3d& pivot, const Vector3d& tip) {
  const Vector3d along = tip - pivot;
  const double length = std::sqrt(along.squaredNorm());
  if (!(length > 1e-6)) return orientation;
  const Vector3d to = along / length, from = orientation * Vector3d::UnitZ();
  // The shortest rotation from one unit vector to another, by the half angle: no trigonometry.
  const double w = 1.0 + from.dot(to);
  if (!(w > 1e-9)) return orientation;
  const Vector3d v = from.cross(to);
  Quaterniond turn(w, v.x(), v.y(), v.z());
  turn.coeffs() /= std::sqrt(turn.squaredNorm());
  Quaterniond result = turn * orientation;
  result.coeffs() /= std::sqrt(result.squaredNorm());
  return result;
}

HalfAngle halfAngle(double jaw) {  // jaws open less than 1.3 rad
  const double h = 0.5 * jaw, h2 = h * h;
  return {h * (1 - h2 / 6 * (1 - h2 / 20 * (1 - h2 / 42 * (1 - h2 / 72)))),
          1 - h2 / 2 * (1 - h2 / 12 * (1 - h2 / 30 * (1 - h2 / 56)))};
}

int placeCapsules(const tools::ToolGeometry& g, const ToolPose& pose, PlacedCapsule* out) {
  int count = 0;
  if (g.kind == tools::ToolKind::None) return 0;
  const Eigen::Matrix3d r = pose.orientation.toRotationMatrix();
  const Vector3d axis = pose.tip - r.col(2) * g.jaw_length;  // of the jaws
  // The shaft begins at the trocar's pivot: nothing outside the box touches tissue.
  out[count++] = {pose.pivot, axis, g.shaft_radius, -1};
  for (const auto& c : g.fixed) {
    if (count < kMaxToolCapsules) out[count++] = {pose.tip + r * c.a, pose.tip + r * c.b, c.radius, -1};
  }
  const HalfAngle half = halfAngle(pose.jaw);
  const double s = half.sine, c = half.cosine;
  for (int side = 0; side < 2; ++side) {
    const double sine = side == 0 ? s : -s;
    const auto turned = [&](const Vector3d& p) -> Vector3d {  // about +y
      return axis + r * Vector3d(c * p.x() + sine * p.z(), p.y(), -sine * p.x() + c * p.z());
    };
    for (const auto& k : g.jaw[static_cast<std::size_t>(side)]) {
      if (count < kMaxToolCapsules) out[count++] = {turned(k.a), turned(k.b), k.radius, side};
    }
  }
  return count;
}

}  // namespace vest::interaction
