#pragma once

#include <functional>

#include "tiles.h"
#include "vest_tissue/fem/description.h"

namespace vest::fem {

/// Told how far a long computation is, 0 … 1.
using Progress = std::function<void(double)>;

/// What is left of K u = f where inner nodes are eliminated (static condensation, Guyan 1965,
/// doi 10.2514/3.2874): S u_o = f_o - K_oi K_ii^-1 f_i, S = K_oo - K_oi K_ii^-1 K_io, exactly.
struct Condensed {
  explicit Condensed(std::size_t nodes) : stiffness(nodes) {}
  Tiles stiffness;  ///< S, N/m: free outer nodes in the order that was asked for
  /// The right side per unknown: of gravity along x, y, z, N per m/s²; of the loads of the scene, N.
  Eigen::Matrix<double, Eigen::Dynamic, 4> loads;
  Eigen::Matrix4d inner;  ///< J: -f_i·K_ii^-1 f_i between these four
};

/// Nodes of `outer` stay, in their order; held ones are 0; the others are eliminated: nested dissection by
/// halving space, dense fronts (multifrontal: Duff and Reid 1983, doi 10.1145/356044.356047).
/// @throws std::invalid_argument: an inner part is singular to rounding
Condensed condense(const Description& description, const std::vector<Index>& outer, const Progress& progress);

}  // namespace vest::fem
