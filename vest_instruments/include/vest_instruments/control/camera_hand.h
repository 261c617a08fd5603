#pragma once

#include <Eigen/Geometry>

#include "vest_instruments/kinematics/arm.h"

namespace vest::control {

/// The assistant's hand on the endoscope: it turns the view, goes in and out, and keeps the horizon level.
/// Frame W has its z against gravity.

/// As seen in the picture; or rates of the same, per second.
struct CameraMotion {
  double right = 0.0;  ///< rad
  double down = 0.0;   ///< rad
  double in = 0.0;     ///< m along the shaft
};

/// Fastest motions: assumed, a calm hand. A quarter of the 70° field of view a second; 3 cm a second.
inline constexpr double kCameraSpeed = 0.3;            ///< rad/s
inline constexpr double kCameraSpeedInsertion = 0.03;  ///< m/s

/// Roll at which the picture's right is horizontal and its down points down; where there is no such roll
/// (the shaft stands upright) that of `q` stays.
double levelRoll(const Eigen::Isometry3d& X_WTrocar, const kinematics::JointPositions& q,
                 const Eigen::Matrix3d& R_TipOptical);

/// The joints after a small motion, horizon level, inside the limits. The light post stays.
kinematics::JointPositions moveCamera(const Eigen::Isometry3d& X_WTrocar, const kinematics::JointPositions& q,
                                      const CameraMotion& motion, const kinematics::JointLimits& limits,
                                      const Eigen::Matrix3d& R_TipOptical);

/// Motion in `seconds` that brings a point towards the middle of the picture, no faster than kCameraSpeed;
/// none while it is within `dead_zone` (rad) of it, or behind the lens.
/// @param p_Optical the point in the optical frame (z forward, x right, y down), m
CameraMotion follow(const Eigen::Vector3d& p_Optical, double dead_zone, double seconds);

}  // namespace vest::control
