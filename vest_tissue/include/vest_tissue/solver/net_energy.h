#pragma once

#include <vector>

#include <Eigen/Core>

#include "vest_tissue/net/elements.h"
#include "vest_tissue/solver/step_bound.h"

/// Potential of a net in double precision, with its gradient and a positive semi-definite stiffness: what the
/// implicit step and the equilibrium minimise. The laws are those of the float kernels (net/link_kernel.h,
/// net/elements.h).
namespace vest::solver {

/// A net to look at; does not own anything.
struct NetView {
  BoundLinks links;  ///< block: masses, fixed knots (inverse mass 0), damping
  const net::Elements* elements = nullptr;
};

using Positions = std::vector<Eigen::Vector3d>;  ///< m, at least as many as the net has knots

/// J. Gravity is not part of it.
double netEnergy(const NetView& net, const Positions& x);
/// N: adds dE/dx (minus the force) to `gradient`.
void addNetGradient(const NetView& net, const Positions& x, Positions& gradient);

/// Receives the pieces of a stiffness matrix: block (i, j) and its mirror, for i != j once.
class StiffnessSink {
 public:
  virtual ~StiffnessSink() = default;
  virtual void add(std::uint32_t i, std::uint32_t j, const Eigen::Matrix3d& block) = 0;
};
/// d²E/dx² without the parts that may be negative: links keep the tangent and a tension, not the transverse
/// part of a thrust; bending, hinges and small volumes their Gauss-Newton part. Large enclosed volumes are
/// left out: they couple all knots, by one vector each (volumeMode).
void addNetStiffness(const NetView& net, const Positions& x, StiffnessSink& sink);
/// Damping matrix d(force)/d(-velocity) at these positions times `factor`: links, plastic links, tethers.
void addNetDamping(const NetView& net, const Positions& x, double factor, StiffnessSink& sink);

/// A volume of so few knots couples them as any element does.
inline constexpr std::size_t kSmallVolume = 12;
inline bool isSmall(const net::Volume& v) {
  return v.knots.size() <= kSmallVolume;
}
/// Stiffness of volume `index` is scale·g·g^T; g in m², zeroed and filled here. Returns scale in Pa/m³, 0
/// where the pressure is constant or the volume is small.
double volumeMode(const NetView& net, std::size_t index, const Positions& x, Positions& g);

/// Angle of (c, s) against (1, 0) for s >= 0, 0 … pi, rad, error below 1e-13; no libm.
double angleOf(double s, double c);

}  // namespace vest::solver
