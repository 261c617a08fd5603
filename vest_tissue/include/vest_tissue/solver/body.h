#pragma once

#include <Eigen/Core>

#include "vest_tissue/net/anchor.h"

namespace vest::solver {

/// The one solver interface: whatever acts on tissue, be it net, elastostatic or volume,
/// uses this and nothing else: contact, threads, joints between objects of different kinds, the haptic force
/// model. Real-time safe: no call allocates, logs or throws.
class Body {
 public:
  virtual ~Body() = default;
  virtual Eigen::Vector3d position(const net::Anchor& anchor) const = 0;  ///< m, world
  virtual Eigen::Vector3d velocity(const net::Anchor& anchor) const = 0;  ///< m/s, world
  virtual void applyImpulse(const net::Anchor& anchor,
                            const Eigen::Vector3d& impulse) = 0;  ///< N·s, world, acts in this step
  /// Local compliance: displacement per force held for one step, m/N, symmetric positive semi-definite.
  virtual Eigen::Matrix3d compliance(const net::Anchor& anchor) const = 0;
};

}  // namespace vest::solver
