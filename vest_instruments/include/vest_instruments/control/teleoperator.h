#pragma once

#include <Eigen/Geometry>

#include "vest_instruments/control/input_map.h"

namespace vest::control {

/// A hand without a handle: keyboard, mouse or gamepad move a tip by steps, within the arm's limits. Gives
/// the pose for servo_cp of the source `teleop`. No clock, log or allocation.
class Teleoperator {
 public:
  /// Begins where an instrument begins that nobody moved yet.
  explicit Teleoperator(const kinematics::TrainerArm& arm);

  /// Where the instrument is; to be called while another source moves it, so that a take-over has no jump.
  void place(const Joints& q);
  /// Moves the tip by a step in phantom_box, m; roll and jaw stay.
  void shift(const Eigen::Vector3d& step_B);
  /// Adds to the joints: yaw, pitch rad, insertion m, roll, jaw rad.
  void add(const Joints& step);
  /// One step of a gamepad. @param axes −1 … 1 @param buttons bit i: button i is down. @param dt s
  void drive(const PadControl& pad, const std::vector<double>& axes, std::uint32_t buttons, double dt);

  const Joints& joints() const { return q_; }
  Eigen::Isometry3d tip() const { return kinematics::forwardKinematics(arm_.X_BTrocar, fromJoints(q_)); }
  double jaw() const { return q_[4]; }

 private:
  kinematics::TrainerArm arm_;
  Joints q_;
};

}  // namespace vest::control
