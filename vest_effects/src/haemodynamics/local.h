#pragma once

#include "vest_effects/haemodynamics/step.h"

namespace vest::haemodynamics {

/// Replaces the flux at the face of closure `index` by that through the narrowing. Of several closures at one
/// face the narrowest counts.
void applyClosure(const Model& model, const Inputs& inputs, int index, Scratch& scratch);

/// After the cells' update: gives the cell behind the narrowing its own velocity flux.
void finishClosure(const Model& model, const Inputs& inputs, int index, double dt, State& state,
                   const Scratch& scratch);

/// Lets blood out of the cell at a hole, implicitly. Returns the volume lost, m³.
double leak(const Model& model, const Hole& hole, double dt, State& state);

}  // namespace vest::haemodynamics
