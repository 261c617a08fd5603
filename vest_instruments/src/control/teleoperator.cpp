#include "vest_instruments/control/teleoperator.h"

#include <algorithm>

namespace vest::control {

Teleoperator::Teleoperator(const kinematics::TrainerArm& arm) : arm_(arm) {
  place(startJoints(arm));
}

void Teleoperator::place(const Joints& q) {
  if (!q.allFinite()) return;
  q_ = q.cwiseMax(toJoints(arm_.limits.lower)).cwiseMin(toJoints(arm_.limits.upper));
}

void Teleoperator::shift(const Eigen::Vector3d& step_B) {
  Eigen::Isometry3d wanted = tip();
  wanted.translation() += step_B;
  kinematics::JointPositions q =
      kinematics::inverseKinematics(arm_.X_BTrocar, wanted, fromJoints(q_), arm_.limits).q;
  q.roll = q_[3];
  place(toJoints(q));
}

void Teleoperator::add(const Joints& step) {
  place(q_ + step);
}

void Teleoperator::drive(const PadControl& pad, const std::vector<double>& axes, std::uint32_t buttons,
                         double dt) {
  Joints step = Joints::Zero();
  for (std::size_t k = 0; k < pad.joints.size(); ++k) {
    const JointControl& c = pad.joints[k];
    double rate = 0.0;
    if (c.axis >= 0 && static_cast<std::size_t>(c.axis) < axes.size())
      rate += c.sign * axes[static_cast<std::size_t>(c.axis)];
    if (c.minus >= 0 && (buttons >> c.minus & 1u) != 0) rate -= 1.0;
    if (c.plus >= 0 && (buttons >> c.plus & 1u) != 0) rate += 1.0;
    const double speed = k == 2 ? pad.speed : k == 3 ? 2.0 * pad.turn : pad.turn;
    step[static_cast<Eigen::Index>(k)] = std::clamp(rate, -1.0, 1.0) * speed * dt;
  }
  add(step);
}

}  // namespace vest::control
