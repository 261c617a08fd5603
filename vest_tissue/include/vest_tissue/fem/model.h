#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include <Eigen/Core>

#include "vest_tissue/fem/block_ldlt.h"
#include "vest_tissue/fem/description.h"
#include "vest_tissue/fem/element.h"
#include "vest_tissue/fem/workers.h"

namespace vest::fem {

/// Immutable once built.
struct Model {
  Description description;
  std::vector<Lame> laws;  ///< per element, Pa
  std::vector<Element> elements;
  std::vector<double> mass;           ///< kg per node, lumped: sum of density·volume/4 over its tetrahedra
  std::vector<Eigen::Vector3d> load;  ///< N per node
  std::vector<Eigen::Vector3d> held_at;  ///< m per node: place of held nodes (rest + prescribed displacement)
  std::vector<std::int32_t> unknown;     ///< per node: block row; -1: held, or in no tetrahedron
  std::vector<Index> free_node;          ///< per block row: node
  std::vector<std::size_t> incidence_start;  ///< CSR: node -> entries of incidence
  std::vector<std::uint32_t> incidence;  ///< 4·element + corner, ascending: forces are summed in this order
  BlockLdlt matrix;                      ///< pattern; each Scratch has a copy with numbers
  std::vector<std::array<BlockLdlt::Slot, 10>> slots;  ///< per element, corner pairs of kPairs
};

/// Corner pairs of an element, in the order of Model::slots.
inline constexpr std::array<std::array<int, 2>, 10> kPairs{
    {{0, 0}, {1, 1}, {2, 2}, {3, 3}, {0, 1}, {0, 2}, {0, 3}, {1, 2}, {1, 3}, {2, 3}}};
inline constexpr std::uint32_t kNoSlot = 0xffffffffu;

/// Everything that evolves. A copy is a snapshot.
struct State {
  std::vector<Eigen::Vector3d> x;   ///< m, world
  std::vector<Eigen::Vector3d> v;   ///< m/s
  std::vector<std::uint8_t> alive;  ///< per element; 0: cut away
  std::uint32_t revision = 0;       ///< of `alive`
};

/// Sized once, no meaning between steps (but for the factor of a linear object, kept while it fits).
struct Scratch {
  Scratch(const Model& model, int threads);
  std::vector<Eigen::Matrix3d> rotation;               ///< per element
  std::vector<std::array<Eigen::Vector3d, 4>> corner;  ///< per element, N
  std::vector<Eigen::Vector3d> force, force2, v_next;  ///< per node
  std::vector<double> element_energy;                  ///< J
  BlockLdlt matrix;
  Eigen::VectorXd rhs;  ///< per unknown
  Workers workers;
  double factored_dt = 0.0;  ///< s; 0: no valid factor of the backward-Euler matrix
  std::uint32_t factored_revision = 0;
};

/// @throws std::invalid_argument as validate()
std::unique_ptr<const Model> buildModel(const Description& description, Use use);
State restState(const Model& model);

/// Rotations of all live elements at x; identity for small strain.
void updateRotations(const Model& model, const State& state, Scratch& scratch);
/// scratch.force = -gradient of the strain energy at state.x, per node, N. Needs rotations.
void elasticForces(const Model& model, const State& state, Scratch& scratch);
/// scratch.force2 = -K_R v: the tangent with rotations held, applied to velocities. Needs rotations.
void stiffnessTimes(const Model& model, const State& state, const std::vector<Eigen::Vector3d>& v,
                    Scratch& scratch);
/// J. Needs rotations.
double strainEnergy(const Model& model, const State& state, Scratch& scratch);

/// Frozen: R K_e R^T. Exact: Hessian of the energy. Projected: the same with negative twist modes left out,
/// so that it is positive definite. All are equal for small strain.
enum class Tangent : std::uint8_t { Frozen, Exact, Projected };
/// scratch.matrix = mass_factor·M + stiffness_factor·K over the unknowns. Needs rotations.
void assemble(const Model& model, const State& state, double mass_factor, double stiffness_factor,
              Tangent tangent, Scratch& scratch);

}  // namespace vest::fem
