#pragma once

#include "vest_tissue/net/block.h"
#include "vest_tissue/solver/body.h"

namespace vest::net {

/// A net behind the one solver interface. Does not own the block, which must outlive it.
class NetBody final : public solver::Body {
 public:
  /// @param step s, for which a force is held (compliance)
  /// @param omega_squared 1/s²: stiffness over mass of the net at a knot, for the compliance; 0: free knots
  NetBody(Block& block, double step, double omega_squared)
      : block_(block), step_(step), omega_squared_(omega_squared) {}

  Eigen::Vector3d position(const Anchor& anchor) const override;
  Eigen::Vector3d velocity(const Anchor& anchor) const override;
  void applyImpulse(const Anchor& anchor, const Eigen::Vector3d& impulse) override;
  /// Of a mass held by its neighbours: h²/(m·(1 + h²·omega²)), the anchor's weights squared; isotropic.
  Eigen::Matrix3d compliance(const Anchor& anchor) const override;

 private:
  Eigen::Vector3d sum(const Anchor& anchor, Block::KnotRow first) const;
  Block& block_;
  double step_, omega_squared_;
};

}  // namespace vest::net
