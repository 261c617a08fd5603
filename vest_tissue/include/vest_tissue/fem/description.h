#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include <Eigen/Core>

/// Elastostatic and elastodynamic tissue of linear tetrahedra. Any consistent unit
/// system; the units in comments are SI. Frame: world.
namespace vest::fem {

using Index = std::uint32_t;

/// Small: Cauchy strain of the undeformed shape, exact for small displacements, one linear solve.
/// Corotational: the same law in each element's own rotated frame (polar decomposition), for large rotations.
enum class Strain : std::uint8_t { Small = 0, Corotational = 1 };

/// What the object is going to be used for: dynamics needs mass, statics needs something fixed.
enum class Use : std::uint8_t { Static = 0, Dynamic = 1 };

/// How an object answers its loads.
/// BackwardEuler: with inertia and Rayleigh damping, small or corotational strain (fem/simulate.h).
/// Elastostatic: fast finite elements (fem/tissue.h), each step the equilibrium under the forces of that
/// step, from the loaded columns of the precomputed inverse alone; small strain. Cut, clipped or denatured it
/// takes its equilibrium from a factor of its mesh (fem/cut_factor.h); what a cut frees moves with inertia.
/// Condensed: elastostatic between nodes that can be touched, the inner ones eliminated exactly
/// (docs/decisions/0017-…). It stays elastostatic: blades, clips and slings do not take hold of it.
enum class Motion : std::uint8_t { BackwardEuler = 0, Elastostatic = 1, Condensed = 2 };

struct Material {
  double youngs_modulus = 0.0;      ///< E, Pa, > 0
  double poisson_ratio = 0.0;       ///< nu, no unit, -1 < nu < 0.5 (positive definite elasticity)
  double density = 0.0;             ///< kg/m³; > 0 for dynamics, >= 0 for statics
  double rayleigh_mass = 0.0;       ///< a, 1/s, >= 0; damping C = a·M + b·K
  double rayleigh_stiffness = 0.0;  ///< b, s, >= 0
};

struct Load {
  Index node = 0;
  Eigen::Vector3d force = Eigen::Vector3d::Zero();  ///< N, constant
};

/// A node that is held away from its place.
struct Prescribed {
  Index node = 0;
  Eigen::Vector3d displacement = Eigen::Vector3d::Zero();  ///< m
};

/// One object as its files say. Nodes that no tetrahedron uses stay where they are.
struct Description {
  std::string name;
  Strain strain = Strain::Small;
  Motion motion = Motion::BackwardEuler;         ///< in a World
  bool start_in_equilibrium = false;             ///< in a World: under gravity and loads, not at rest
  std::vector<Eigen::Vector3d> nodes;            ///< m, shape without load
  std::vector<std::array<Index, 4>> tetrahedra;  ///< positive volume: (n1-n0)·((n2-n0)×(n3-n0)) > 0
  std::vector<Index> fixed;                      ///< nodes; repeated ones count once
  std::vector<Prescribed> prescribed;
  Material material;
  /// Elasticity and density by cell (volume models): cell_material[t] is an index into `materials`. Both
  /// empty: `material` everywhere. Rayleigh's coefficients are those of `material` for the whole object.
  std::vector<Material> materials;
  std::vector<std::uint16_t> cell_material;
  std::vector<Load> loads;  ///< several on one node add up
  /// Condensed: of the nodes, how many there are that can be touched; they come first.
  Index outer = 0;

  const Material& materialOf(std::size_t tetrahedron) const {
    return cell_material.empty() ? material : materials[cell_material[tetrahedron]];
  }
};

/// 1: a tetrahedron of positive volume; -1: inverted; 0: flat, its gradients would lose more than half of the
/// digits of a double.
int orientation(const std::array<Eigen::Vector3d, 4>& corners);

/// Refuses what cannot be computed. @throws std::invalid_argument: object, element or field, value, what is
/// allowed. Statics refuses a component of elements that shares no node with `fixed` or `prescribed`.
void validate(const Description& description, Use use);

/// Per node, the number of its component (elements that share a node belong together); -1: no live element
/// uses it. Components are numbered in the order of their smallest node. `alive`: per element, empty means
/// all.
std::vector<int> components(const Description& description, const std::vector<std::uint8_t>& alive);

}  // namespace vest::fem
