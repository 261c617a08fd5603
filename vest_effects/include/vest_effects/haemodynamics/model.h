#pragma once

#include <string>
#include <vector>

#include "vest_effects/haemodynamics/network.h"

namespace vest::haemodynamics {

/// One-dimensional blood flow in elastic, tapering arteries (equations as in Boileau et
/// al. 2015, Int. J. Numer. Meth. Biomed. Eng. 31(10) e02732, section 2). Area A(x,t), mean velocity U,
/// pressure P:
///
///     A_t + (A U)_x = 0
///     U_t + (U²/2 + P/rho)_x = f/(rho A),      f = −2(zeta + 2) mu pi U
///     P = P_ref + beta (sqrt A − sqrt A_ref),  beta = (4/3) sqrt(pi) E h / A_ref,  A_ref = pi r²
///
/// The (A, U) form is a conservation law with no source from the taper: the total pressure U²/2 + P/rho is
/// the flux. Wave speed c² = beta sqrt(A) / (2 rho); Riemann invariants of a piece of constant beta: U ± 4c.
struct SegmentModel {
  std::string id, name;
  int cells = 0;
  int first_cell = 0;                          ///< into the arrays per cell
  int first_face = 0;                          ///< into the arrays per face; cells + 1 of them
  double length = 0;                           ///< m
  double dx = 0;                               ///< m
  double reference_pressure = 0;               ///< Pa
  double sqrt_area_ref_mid = 0, beta_mid = 0;  ///< at length/2: m, Pa/m
  int node_in = 0, node_out = 0;               ///< into Model::nodes
};

/// Where a segment meets a node.
struct Branch {
  int segment = 0;
  bool distal = false;            ///< the segment ends here (else it starts here)
  int cell = 0, face = 0;         ///< the segment's last (first) cell and face
  double sign = 1;                ///< +1 distal, −1 proximal: U·sign is flow towards the node
  double reference_pressure = 0;  ///< Pa
  double speed_ref_squared = 0;   ///< beta sqrt(A_ref)/(2 rho) at the face, m²/s²
  double area_factor = 0;         ///< (2 rho/beta)²: A = this · c⁴
  double inv_dx = 0;              ///< 1/m
};

enum class NodeKind { kInflow, kJunction, kTerminal };

struct NodeModel {
  long label = 0;  ///< as in the file
  NodeKind kind = NodeKind::kJunction;
  int first_branch = 0, branches = 0;  ///< into Model::branches
  Windkessel load;                     ///< kTerminal only
};

/// Everything that never changes after buildModel().
struct Model {
  double density = 0, viscosity = 0, profile = 0, period = 0;  ///< as in Network
  double friction = 0;  ///< 2(zeta + 2) mu pi / rho, m²/s: U_t = −friction·U/A
  int cells = 0;
  std::vector<SegmentModel> segments;
  std::vector<Branch> branches;
  std::vector<NodeModel> nodes;
  // per cell, at its centre
  std::vector<double> sqrt_area_ref;  ///< m
  std::vector<double> beta;           ///< Pa/m
  // per face
  std::vector<double> face_sqrt_area_ref;  ///< m
  std::vector<double> face_inv_beta;       ///< m/Pa
  std::vector<double> face_half_rho_beta;  ///< rho·beta/2: (rho c)² = this · sqrt(A)
  // inflow, extended to [0, period]; linear between
  std::vector<double> inflow_time, inflow_flow, inflow_volume;  ///< s, m³/s, m³ since 0

  /// Inflow at a phase in [0, period], m³/s.
  double inflowAt(double phase) const;
  /// Inflow volume from phase 0 to any phase ≥ 0, m³.
  double inflowVolume(double phase) const;
};

/// Fewest cells of a segment; shorter segments get this many, smaller cells.
constexpr int kLeastCells = 2;
/// Most cells of a model: a guard against a mistyped dx, checked before anything is allocated.
constexpr long kMostCells = 4'000'000;

/// Checks everything and builds the model with cells of at most `dx` metres.
/// Throws NetworkError naming file, line, field, value and what is allowed:
/// numbers out of range, duplicate ids or names, no or several inflow nodes, parts that the inflow does not
/// reach, ends without terminal parameters, terminals that share their node.
Model buildModel(const Network& network, double dx);

}  // namespace vest::haemodynamics
