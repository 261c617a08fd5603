#include "vest_instruments/kinematics/arm.h"

#include <algorithm>
#include <cmath>

namespace vest::kinematics {
namespace {

using Eigen::AngleAxisd;
using Eigen::Isometry3d;
using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kPi = 3.14159265358979323846;

Matrix3d shaftRotation(double yaw, double pitch) {
  return (AngleAxisd(yaw, Vector3d::UnitY()) * AngleAxisd(pitch, Vector3d::UnitX())).toRotationMatrix();
}

/// The turn of `angle` (angle + 2 pi k) nearest to `reference`.
double nearestTurn(double angle, double reference) {
  return angle + 2.0 * kPi * std::round((reference - angle) / (2.0 * kPi));
}

}  // namespace

Isometry3d forwardKinematics(const Isometry3d& X_WTrocar, const JointPositions& q) {
  Isometry3d X = Isometry3d::Identity();
  const Matrix3d R = shaftRotation(q.yaw, q.pitch);
  X.linear() = R * AngleAxisd(q.roll, Vector3d::UnitZ()).toRotationMatrix();
  X.translation() = R.col(2) * q.insertion;
  return X_WTrocar * X;
}

InverseResult inverseKinematics(const Isometry3d& X_WTrocar, const Isometry3d& X_WT_wanted,
                                const JointPositions& reference, const JointLimits& limits) {
  InverseResult result;
  result.q = reference;
  if (!X_WT_wanted.matrix().allFinite()) return result;

  // In the trocar frame the tip lies at insertion · (cos pitch sin yaw, −sin pitch, cos pitch cos yaw).
  const Isometry3d X = X_WTrocar.inverse(Eigen::Isometry) * X_WT_wanted;
  const Vector3d p = X.translation();
  // At the pivot every direction fits: the shaft keeps the reference's.
  constexpr double kAtPivot = 1e-9;  // m
  JointPositions& q = result.q;
  const bool at_pivot = p.norm() < kAtPivot;
  q.yaw =
      std::clamp(!at_pivot && std::hypot(p.x(), p.z()) > kAtPivot ? std::atan2(p.x(), p.z()) : reference.yaw,
                 limits.lower.yaw, limits.upper.yaw);
  // Nearest point on what the limits leave: pitch in the plane that the (clamped) yaw leaves, then the
  // insertion as the projection on the (clamped) shaft.
  const double forward = p.x() * std::sin(q.yaw) + p.z() * std::cos(q.yaw);
  q.pitch = std::clamp(at_pivot ? reference.pitch : std::atan2(-p.y(), forward), limits.lower.pitch,
                       limits.upper.pitch);
  const Matrix3d R = shaftRotation(q.yaw, q.pitch);
  q.insertion = std::clamp(R.col(2).dot(p), limits.lower.insertion, limits.upper.insertion);
  constexpr double kExact = 1e-9;  // m: far below any sensor, far above rounding
  result.reachable = (R.col(2) * q.insertion - p).norm() < kExact;

  // Roll maximises trace(Rz(roll)^T · M): the nearest attitude in the Frobenius norm.
  const Matrix3d M = R.transpose() * X.linear();
  const double s = M(1, 0) - M(0, 1), c = M(0, 0) + M(1, 1);
  const double roll =
      std::hypot(s, c) > 1e-12 ? nearestTurn(std::atan2(s, c), reference.roll) : reference.roll;
  q.roll = std::clamp(roll, limits.lower.roll, limits.upper.roll);
  return result;
}

}  // namespace vest::kinematics
