#pragma once

#include "vest_effects/haemodynamics/step.h"

namespace vest::haemodynamics {

/// Solves one node from the outgoing characteristics in scratch.p_left … u_right and writes the end fluxes
/// and the solution (node_pressure_p, node_velocity) at its faces. `inflow` in m³/s is used at the inflow
/// node. A dt > 0 also advances the windkessel and the volume account. Returns the greatest (|U| + c)/dx, or
/// a negative number if Newton did not converge.
double solveNode(const Model& model, const Inputs& inputs, int node, double inflow, double dt, State& state,
                 Scratch& scratch);

}  // namespace vest::haemodynamics
