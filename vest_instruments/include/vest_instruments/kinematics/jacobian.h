#pragma once

#include <Eigen/Geometry>

#include "vest_instruments/kinematics/arm.h"

namespace vest::kinematics {

/// Geometric Jacobian of the tip: rows 0–2 linear (m/s), rows 3–5 angular (rad/s) velocity in W; columns yaw,
/// pitch, insertion, roll. twist = J · q', and, by virtual work, joint loads = J^T · wrench at the tip.
/// Columns are axis × (tip − pivot) and axis for the rotations, the axis for the insertion (textbook, e.g.
/// Siciliano et al., Robotics, 2009, section 3.1).
Eigen::Matrix<double, 6, 4> tipJacobian(const Eigen::Isometry3d& X_WTrocar, const JointPositions& q);

/// Camera frame (REP 103: z along the line of sight, x right, y down) in the endoscope's tip frame: the line
/// of sight is tilted by optic_angle about the tip's x towards +y (down in the picture) and that tilt is
/// turned by light_post about the shaft; the camera itself keeps its up, as a hand holds the camera head.
/// Radians.
Eigen::Isometry3d opticalFrame(double optic_angle, double light_post);

}  // namespace vest::kinematics
