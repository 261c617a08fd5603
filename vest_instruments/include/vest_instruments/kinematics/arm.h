#pragma once

#include <Eigen/Geometry>

namespace vest::kinematics {

/// Joint positions of an instrument behind its trocar (docs/conventions.md, "Joints").
struct JointPositions {
  double yaw = 0.0;        ///< rad, about the trocar's y
  double pitch = 0.0;      ///< rad, about the x turned by yaw
  double insertion = 0.0;  ///< m from the pivot to the tip, >= 0
  double roll = 0.0;       ///< rad, about z
  double jaw = 0.0;        ///< rad, full opening angle, 0 closed; light_post for the endoscope
};

/// Tip pose for given joints: X_WT = X_WTrocar · Ry(yaw) · Rx(pitch) · Tz(insertion) · Rz(roll).
/// @param X_WTrocar pose of the trocar frame (z inward at zero angles, x to the right) in the frame W
Eigen::Isometry3d forwardKinematics(const Eigen::Isometry3d& X_WTrocar, const JointPositions& q);

/// Result of inverse kinematics.
struct InverseResult {
  JointPositions q;        ///< nearest reachable joints; jaw is copied from the reference
  bool reachable = false;  ///< position exact within limits
};

/// Joint limits; insertion in metres, the others in radians.
struct JointLimits {
  JointPositions lower{-1.2, -1.2, 0.0, -3.14159265358979, 0.0};
  JointPositions upper{1.2, 1.2, 0.3, 3.14159265358979, 1.2};
};

/// Position exact, roll nearest (docs/conventions.md). The roll stays on the turn nearest to the reference's.
InverseResult inverseKinematics(const Eigen::Isometry3d& X_WTrocar, const Eigen::Isometry3d& X_WT_wanted,
                                const JointPositions& reference, const JointLimits& limits);

}  // namespace vest::kinematics
