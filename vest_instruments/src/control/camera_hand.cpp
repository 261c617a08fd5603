#include "vest_instruments/control/camera_hand.h"

#include <algorithm>
#include <cmath>

namespace vest::control {

using Eigen::Vector3d;

double levelRoll(const Eigen::Isometry3d& X_WTrocar, const kinematics::JointPositions& q,
                 const Eigen::Matrix3d& R_TipOptical) {
  kinematics::JointPositions unrolled = q;
  unrolled.roll = 0.0;
  // Height of a direction d of the tip's frame after a roll r: cos(r)·A + sin(r)·B + C.
  const Eigen::RowVector3d height = kinematics::forwardKinematics(X_WTrocar, unrolled).linear().row(2);
  const auto heightAfter = [&](const Vector3d& d, double r) {
    return height.dot(Eigen::AngleAxisd(r, Vector3d::UnitZ()) * d);
  };
  const Vector3d right = R_TipOptical.col(0), down = R_TipOptical.col(1);
  const double A = height[0] * right[0] + height[1] * right[1];
  const double B = height[1] * right[0] - height[0] * right[1];
  const double C = height[2] * right[2];
  const double size = std::hypot(A, B);
  constexpr double kUpright = 1e-3;  // no unit: sine of the shaft's angle to the vertical
  if (size < kUpright || std::abs(C) > size) return q.roll;
  const double middle = std::atan2(B, A), half = std::acos(-C / size);
  const double roll =
      heightAfter(down, middle + half) < heightAfter(down, middle - half) ? middle + half : middle - half;
  return std::remainder(roll, 2.0 * M_PI);
}

kinematics::JointPositions moveCamera(const Eigen::Isometry3d& X_WTrocar, const kinematics::JointPositions& q,
                                      const CameraMotion& motion, const kinematics::JointLimits& limits,
                                      const Eigen::Matrix3d& R_TipOptical) {
  const Eigen::Isometry3d X_WTip = kinematics::forwardKinematics(X_WTrocar, q);
  const Eigen::Matrix3d R = X_WTip.linear() * R_TipOptical;
  const Vector3d axis =
      (X_WTip.linear().col(2) + motion.right * R.col(0) + motion.down * R.col(1)).normalized();
  Eigen::Isometry3d wanted = X_WTip;
  constexpr double kDirection = 0.1;  // m: far enough from the pivot to tell a direction
  wanted.translation() = X_WTrocar.translation() + kDirection * axis;
  kinematics::JointPositions next = kinematics::inverseKinematics(X_WTrocar, wanted, q, limits).q;
  next.insertion = std::clamp(q.insertion + motion.in, limits.lower.insertion, limits.upper.insertion);
  next.roll = std::clamp(levelRoll(X_WTrocar, next, R_TipOptical), limits.lower.roll, limits.upper.roll);
  next.jaw = q.jaw;
  return next;
}

CameraMotion follow(const Vector3d& p, double dead_zone, double seconds) {
  CameraMotion motion;
  if (!p.allFinite() || !(p.z() > 0.0)) return motion;
  Eigen::Vector2d angle(std::atan2(p.x(), p.z()), std::atan2(p.y(), p.z()));
  const double off = angle.norm();
  if (!(off > dead_zone)) return motion;
  angle *= std::min(off - dead_zone, kCameraSpeed * seconds) / off;
  motion.right = angle.x();
  motion.down = angle.y();
  return motion;
}

}  // namespace vest::control
