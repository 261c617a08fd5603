#pragma once

#include "elements.h"

/// Newton's passes over one sub-step, shared by steps and statics.
namespace vest::suture {

/// Where held nodes are at a time: scratch.target and scratch.held_frame.
void aim(const Model& model, double time, Scratch& scratch);

/// Strains at the sub-step's start, for what depends on their rate.
void remember(const Model& model, const State& s, Scratch& scratch);

void copyMotion(const State& from, State& to);

/// Which Hessian was positive definite: the exact one, or that with the geometric part of taut segments.
enum class Factor : std::uint8_t { None = 0, Taut = 1, Exact = 2 };

struct PassResult {
  Factor factor = Factor::None;
  double change = 1.0;  ///< greatest: rad, or of a segment's length
  double bent = 1.0;    ///< the same, of what neighbours do not have in common
  bool whole = false;   ///< not shortened
  bool touching = false;
};

/// One pass; the first one takes held nodes along, the later ones lower the potential.
/// @param kept the factor of a pass before that serves once more; None: a new one
PassResult pass(const Potential& p, State& s, bool first, Scratch& scratch, Factor kept = Factor::None);

}  // namespace vest::suture
