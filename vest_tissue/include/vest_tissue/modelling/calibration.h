#pragma once

#include <string>
#include <vector>

#include "vest_tissue/modelling/lattice.h"

/// What a net's links make of it as a piece of material, measured on its equilibrium in double precision:
/// whatever its topology, mesh and step.
namespace vest::modelling {

/// Shape of a net under forces on its knots (N per knot), from its rest positions; fixed knots stay. Without
/// any, the forces must balance, and pull rather than push: a free body turns to where it is pulled. @throws
/// std::runtime_error if no equilibrium is found
std::vector<Eigen::Vector3d> equilibrium(const scene::Object& net,
                                         const std::vector<Eigen::Vector3d>& forces);

/// Affine part of a shape: the gradient H of u = H·X + t in the least squares sense.
Eigen::Matrix3d displacementGradient(const scene::Object& net, const std::vector<Eigen::Vector3d>& x);

/// Moduli of a lattice block at small strain (1e-4), by uniform traction.
struct Moduli {
  double youngs = 0.0, poisson = 0.0, shear = 0.0;  ///< Pa, no unit, Pa
};
Moduli moduliOf(const Lattice& lattice);
/// E that the block's bending about y tells: moment over (I·curvature), I = b·h³/12; pure bending along z.
double bendingModulus(const Lattice& lattice);

/// A net of any topology as a bar between its ends along `axis` (0, 1, 2): pulled by a small force of
/// `strain` times E·A, spread over the end knots by the links that reach them.
struct Bar {
  double youngs = 0.0;   ///< Pa, force·length/(area·elongation)
  double poisson = 0.0;  ///< no unit: narrowing over lengthening
};
/// @param area m², the cross-section that E refers to
/// @throws std::invalid_argument if an end has no links; std::runtime_error without equilibrium
Bar pullBar(const scene::Object& net, int axis, double area, double strain = 1e-4);

/// Multiplies the areas of all links that follow the law by one factor, so that the bar shows the law's E; up
/// to `rounds` times, for the elements that do not scale with them. Returns the last bar.
Bar calibrateBar(scene::Object& net, int axis, double area, int rounds = 4);

}  // namespace vest::modelling
