#pragma once

#include <array>

#include "vest_tissue/scene/description.h"

/// From E and nu to links. A cubic lattice of spacing a, with springs of one stiffness k along its edges and
/// its face diagonals, is isotropic: C11 = 3 k/a, C12 = C44 = k/a (sum over the bonds of a cell, k n_i n_j
/// n_k n_l l²; Born and Huang 1954, Dynamical Theory of Crystal Lattices, section 11), so lambda = mu = k/a:
/// nu = 1/4, as for all central springs. A volume element a cell with bulk modulus K adds K to lambda. Hence
///
///     k = mu·a,   K = lambda - mu = E (4 nu - 1) / (2 (1+nu) (1-2 nu)),   1/4 <= nu < 1/2.
///
/// Links on a face of the block have half of that, on an edge a quarter: a block under uniform traction then
/// strains uniformly, whatever its mesh.
namespace vest::modelling {

struct Lattice {
  std::array<int, 3> cells{4, 4, 16};             ///< >= 1 along x, y, z
  double cell = 0.005;                            ///< a, m, > 0
  Eigen::Vector3d low = Eigen::Vector3d::Zero();  ///< m, its least corner
  material::Law law;                              ///< of the tissue: E, and a2 … a4 as fitLinkLaw() made
                                                  ///< them for links
  double poisson_ratio = 0.25;                    ///< 0.25 … 0.4999
  double density = 1000.0;                        ///< kg/m³
  double damping_time = 0.0;                      ///< s: link damping over link stiffness

  std::size_t knots() const;
  scene::Index knot(int i, int j, int k) const;
  Eigen::Vector3d size() const;  ///< m
};

/// @throws std::invalid_argument naming field, value and what is allowed
scene::Object makeLattice(const Lattice& lattice);

/// Forces on the knots, N, that a uniform Cauchy stress (Pa, symmetric) exerts on the block's faces.
std::vector<Eigen::Vector3d> uniformTraction(const Lattice& lattice, const Eigen::Matrix3d& stress);

/// Stress of the lattice in a bar that is stretched by `strain` and free across, in units of E, by its unit
/// cell: each link follows `links` (E = 1 of the bar). Also the strain across.
struct BarResponse {
  double stress = 0.0, across = 0.0;
};
BarResponse barResponse(const material::Law& links, double poisson_ratio, double strain);

/// Coefficients a2 … a4 and max_strain of the links for which a bar of the lattice follows `tissue` from 0 to
/// its max_strain; least squares over 40 strains. A link's law cannot express everything: `residual` is the
/// greatest difference, over the greatest stress.
struct LinkLaw {
  material::Law law;
  double residual = 0.0;
};
LinkLaw fitLinkLaw(const material::Law& tissue, double poisson_ratio);

}  // namespace vest::modelling
