#include <cmath>

#include "vest_tissue/fem/simulate.h"

namespace vest::fem {
namespace {

/// The velocities at the step's end, by one solve: s.v_next.
StepStatus beginStep(const Model& model, const StepOptions& o, const State& state, Scratch& s) {
  const Material& m = model.description.material;
  const double dt = o.dt, a = m.rayleigh_mass, b = m.rayleigh_stiffness;
  const bool linear = model.description.strain == Strain::Small;
  if (!(dt > 0.0) || !std::isfinite(dt)) return StepStatus::Fault;
  s.v_next = state.v;
  updateRotations(model, state, s);
  elasticForces(model, state, s);
  stiffnessTimes(model, state, state.v, s);
  if (!linear || s.factored_dt != dt || s.factored_revision != state.revision) {
    assemble(model, state, 1.0 + dt * a, dt * (dt + b), Tangent::Frozen, s);
    if (!s.matrix.factorise()) return StepStatus::Fault;
    s.factored_dt = dt;
    s.factored_revision = state.revision;
  }
  const auto row = [&s](std::size_t i) { return s.rhs.segment<3>(static_cast<Eigen::Index>(3 * i)); };
  for (std::size_t i = 0; i < model.free_node.size(); ++i) {
    const Index n = model.free_node[i];
    // force = -f_int, force2 = -K_R v
    row(i) = dt * (model.load[n] + model.mass[n] * (o.gravity - a * state.v[n]) + s.force[n] +
                   (dt + b) * s.force2[n]);
  }
  s.matrix.solve(s.rhs.data());
  for (std::size_t i = 0; i < model.free_node.size(); ++i) s.v_next[model.free_node[i]] += row(i);
  if (!s.rhs.allFinite()) return StepStatus::Fault;
  return StepStatus::Ok;
}

void endStep(const Model& model, const StepOptions& o, State& state, const Scratch& s) {
  for (const Index n : model.free_node) {
    state.v[n] = s.v_next[n];
    state.x[n] += o.dt * s.v_next[n];
  }
}

/// Newton's iterations beyond the first: v_next += A^-1 r, r = M (v - v+) + dt (f_ext - f_int(x + dt v+) - C
/// v+). `end` is a copy of the state that is moved to the step's end and back.
StepStatus refine(const Model& model, const StepOptions& o, State& state, Scratch& s) {
  const Material& m = model.description.material;
  const double dt = o.dt, a = m.rayleigh_mass, b = m.rayleigh_stiffness;
  for (const Index n : model.free_node) state.x[n] += dt * s.v_next[n];
  updateRotations(model, state, s);
  elasticForces(model, state, s);
  stiffnessTimes(model, state, s.v_next, s);
  assemble(model, state, 1.0 + dt * a, dt * (dt + b), Tangent::Frozen, s);
  for (const Index n : model.free_node) state.x[n] -= dt * s.v_next[n];
  if (!s.matrix.factorise()) return StepStatus::Fault;
  for (std::size_t i = 0; i < model.free_node.size(); ++i) {
    const Index n = model.free_node[i];
    s.rhs.segment<3>(static_cast<Eigen::Index>(3 * i)) =
        model.mass[n] * (state.v[n] - s.v_next[n]) +
        dt * (model.load[n] + model.mass[n] * (o.gravity - a * s.v_next[n]) + s.force[n] + b * s.force2[n]);
  }
  s.matrix.solve(s.rhs.data());
  if (!s.rhs.allFinite()) return StepStatus::Fault;
  for (std::size_t i = 0; i < model.free_node.size(); ++i) {
    s.v_next[model.free_node[i]] += s.rhs.segment<3>(static_cast<Eigen::Index>(3 * i));
  }
  return StepStatus::Ok;
}

}  // namespace

StepStatus step(const Model& model, const StepOptions& o, State& state, Scratch& s) {
  if (beginStep(model, o, state, s) != StepStatus::Ok) return StepStatus::Fault;
  if (model.description.strain == Strain::Corotational) {
    for (int i = 1; i < o.iterations; ++i) {
      if (refine(model, o, state, s) != StepStatus::Ok) return StepStatus::Fault;
    }
  }
  endStep(model, o, state, s);
  return StepStatus::Ok;
}

}  // namespace vest::fem
