#include "vest_tissue/net/net_body.h"

namespace vest::net {

Eigen::Vector3d NetBody::sum(const Anchor& anchor, Block::KnotRow first) const {
  Eigen::Vector3d r = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < 4; ++i) {
    if (anchor.weights[i] == 0.0) continue;
    for (int axis = 0; axis < 3; ++axis) {
      r[axis] += anchor.weights[i] * block_.row(static_cast<Block::KnotRow>(first + axis))[anchor.knots[i]];
    }
  }
  return r;
}

Eigen::Vector3d NetBody::position(const Anchor& anchor) const {
  return sum(anchor, Block::X);
}
Eigen::Vector3d NetBody::velocity(const Anchor& anchor) const {
  return sum(anchor, Block::VX);
}

void NetBody::applyImpulse(const Anchor& anchor, const Eigen::Vector3d& impulse) {
  const float* const w = block_.row(Block::kInverseMass);
  for (std::size_t i = 0; i < 4; ++i) {
    if (anchor.weights[i] == 0.0) continue;
    for (int axis = 0; axis < 3; ++axis) {
      block_.row(static_cast<Block::KnotRow>(Block::VX + axis))[anchor.knots[i]] +=
          static_cast<float>(anchor.weights[i] * w[anchor.knots[i]] * impulse[axis]);
    }
  }
}

Eigen::Matrix3d NetBody::compliance(const Anchor& anchor) const {
  const float* const w = block_.row(Block::kInverseMass);
  double inverse = 0.0;
  for (std::size_t i = 0; i < 4; ++i) {
    if (anchor.weights[i] != 0.0) inverse += anchor.weights[i] * anchor.weights[i] * w[anchor.knots[i]];
  }
  const double h2 = step_ * step_;
  return Eigen::Matrix3d::Identity() * (inverse * h2 / (1.0 + h2 * omega_squared_));
}

}  // namespace vest::net
