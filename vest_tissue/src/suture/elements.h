#pragma once

#include "vest_tissue/suture/rod.h"

/// Strains of rods, their energy and its derivatives.
namespace vest::suture {

/// Γ of segment j.
Eigen::Vector3d strainOf(const Model& model, const State& s, const Strand& strand, Index j);
/// 2·Im p / Re p of joint k.
Eigen::Vector3d bendOf(const Model& model, const State& s, const std::vector<Eigen::Quaterniond>& held_frame,
                       Index k);
/// Moves twist of joint k from its strain to its offset.
void absorbTwist(const Model& model, const std::vector<Eigen::Quaterniond>& held_frame, Index k, State& s);

/// What a pass minimises: elastic energy, damping and inertia of one sub-step that began at `before`.
struct Potential {
  const Model& model;
  const State& before;
  double h = 0.0;       ///< s
  double rotary = 0.0;  ///< statics: rotary inertia beside the true one, of a segment's mass·length²

  Eigen::Vector3d inertia(Index segment) const {
    const double l = model.length[segment];
    return model.inertia[segment].array() + rotary * model.mass[segment] * l * l;
  }
};

/// Its value at `s`.
double valueOf(const Potential& p, const State& s, const Scratch& scratch);

/// m: where a support holds its rod.
Eigen::Vector3d placeOf(const Support& a, const Strand& strand, const State& s);

/// What supports did in a sub-step that ended at `s`: friction that sticks or slides, and their force, of
/// which the step's mean takes `share`.
void settleSupports(const Potential& p, const State& s, double share, Scratch& scratch);

/// Gradient into scratch.gradient, Hessian into scratch.chain, reactions of held nodes.
/// @param exact the whole Hessian; else without what may make it indefinite: the geometric part is then that
/// of taut segments alone, max(T, 0)/l·(I − ttᵀ)
void assemble(const Potential& p, const State& s, bool exact, Scratch& scratch);

/// Gradient and reactions alone, where held nodes are in their places; the Hessian stays what it was.
/// @return false: a support sticks that slid, or the like, and the Hessian is of another potential
bool assembleGradient(const Potential& p, const State& s, Scratch& scratch);

}  // namespace vest::suture
