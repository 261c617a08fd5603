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

/// Rings first … last of a ring net with the links between them: a bar that is cut from an organ. It has no
/// volume element, and nothing holds it. @throws std::out_of_range
scene::Object cutBar(const scene::Object& net, std::uint32_t first, std::uint32_t last);

/// Young's modulus, Pa, of such a bar. It is pulled at its ends along the line between them by a small force,
/// which the links that reach the end rings spread; force · way / (section · elongation) of what lies two
/// rings and more from the ends. The elongation is that of the line of centres: bending does not count.
/// @param section m² of solid wall between rings r and r+1
/// @throws std::invalid_argument if it has fewer than 6 rings, or other sections
double barModulus(const scene::Object& bar, const std::vector<double>& section);

}  // namespace vest::modelling
