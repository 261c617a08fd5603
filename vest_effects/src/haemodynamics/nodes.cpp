#include "nodes.h"

#include <cmath>

namespace vest::haemodynamics {

namespace {

constexpr int kMostIterations = 40;
// The iteration converges quadratically: a last correction of 1e-7 leaves an error near rounding.
constexpr double kTolerance = 1e-7;

/// One end of a segment at a node. The outgoing invariant fixes U for a wave speed c:
/// U = u + 4 sign (c_face − c), sign +1 at a distal end (the node lies ahead), −1 at a proximal one.
struct End {
  int face;
  double sign, p_ref, c_ref_sq, invariant, c, area_factor, inv_dx;

  double velocity() const { return invariant - 4 * sign * c; }
  double pressure(double density) const { return 2 * density * (c * c - c_ref_sq); }  // above P_ref
  double area() const { return area_factor * (c * c) * (c * c); }  // A = (2 rho c²/beta)²
};

inline End endOf(const Model& model, const Branch& branch, const Scratch& scratch) {
  End e;
  e.face = branch.face;
  e.sign = branch.sign;
  e.p_ref = branch.reference_pressure;
  e.c_ref_sq = branch.speed_ref_squared;
  e.area_factor = branch.area_factor;
  e.inv_dx = branch.inv_dx;
  const double p = branch.distal ? scratch.p_right[branch.cell] : scratch.p_left[branch.cell];
  const double u = branch.distal ? scratch.u_right[branch.cell] : scratch.u_left[branch.cell];
  e.c = std::sqrt(e.c_ref_sq + 0.5 * p / model.density);
  e.invariant = u + 4 * e.sign * e.c;
  return e;
}

double writeEnd(const Model& model, const End& e, double velocity, double pressure, Scratch& scratch) {
  scratch.flux_area[e.face] = e.area() * velocity;
  scratch.flux_velocity[e.face] = 0.5 * velocity * velocity + pressure / model.density;
  scratch.node_pressure_p[e.face] = pressure;
  scratch.node_velocity[e.face] = velocity;
  return (std::fabs(velocity) + e.c) * e.inv_dx;
}

// c − sign·U is the slope's factor; a floor keeps Newton defined near critical flow, where the step is
// refused anyway.
double margin(const End& e, double velocity) {
  const double m = e.c - e.sign * velocity;
  return m > 0.02 * e.c ? m : 0.02 * e.c;
}

// A step may change c by at most half of it, so that c stays positive.
double bounded(double step, double c) {
  if (step > 0.5 * c) return 0.5 * c;
  if (step < -0.5 * c) return -0.5 * c;
  return step;
}

/// Windkessel over a sub-step with the flow held: exact for the capacitor but for exp(−x) ~ 1/(1 + x + x²/2),
/// L-stable and of second order; C = 0 is the plain resistance. P = p0 + r·Q is what the vessel sees on
/// average.
double solveTerminal(const Model& model, const Inputs& inputs, int node_index, double dt, State& state,
                     Scratch& scratch) {
  const NodeModel& node = model.nodes[node_index];
  const Windkessel& w = node.load;
  End e = endOf(model, model.branches[node.first_branch], scratch);
  const double r1 = w.proximal_resistance * inputs.resistance_scale;
  const double r2 = w.distal_resistance * inputs.resistance_scale;
  const double p_out = w.outflow_pressure + inputs.outflow_pressure_offset;
  const double tau = r2 * w.compliance;
  const double full = tau * tau + tau * dt + 0.5 * dt * dt;
  const double kept = full > 0 ? tau * tau / full : 0;                     // of P_C − P_inf at the end
  const double mean = full > 0 ? (tau * tau + 0.5 * tau * dt) / full : 0;  // of it on average
  const double p_c = state.windkessel_pressure[node_index];
  const double r = r1 + r2 * (1 - mean);
  const double p0 = p_out + (p_c - p_out) * mean;

  double change = 1;
  int iteration = 0;
  do {
    const double u = e.velocity(), a = e.area();
    const double residual = r * a * u - (e.p_ref + e.pressure(model.density) - p0);
    const double slope = -4 * (r * a / e.c * margin(e, u) + model.density * e.c);
    change = bounded(-residual / slope, e.c);
    e.c += change;
  } while (std::fabs(change) > kTolerance * e.c && ++iteration < kMostIterations);
  const double u = e.velocity();
  const double flow = e.area() * u;
  if (dt > 0) {
    const double p_inf = p_out + r2 * flow;
    state.windkessel_pressure[node_index] = p_inf + (p_c - p_inf) * kept;
    state.node_volume[node_index] -= dt * flow;
  }
  const double rate = writeEnd(model, e, u, e.pressure(model.density), scratch);
  return iteration < kMostIterations && std::isfinite(e.c) ? rate : -1;
}

constexpr int kSmallNode = 16;

}  // namespace

double solveNode(const Model& model, const Inputs& inputs, int node_index, double inflow, double dt,
                 State& state, Scratch& scratch) {
  const NodeModel& node = model.nodes[node_index];
  if (node.kind == NodeKind::kTerminal) return solveTerminal(model, inputs, node_index, dt, state, scratch);
  const double source = node.kind == NodeKind::kInflow ? inflow : 0.0;
  if (dt > 0 && node.kind == NodeKind::kInflow) state.node_volume[node_index] += dt * source;

  // Mass  G = sum sign·A·U + source = 0  and for each end  F = P + rho U²/2 − H = 0. The Jacobian is an
  // arrow: eliminating the ends leaves one equation for the change of H. Ends beyond kSmallNode are rebuilt
  // each time, from their stored speed.
  End small[kSmallNode];
  const int n = node.branches;
  const bool fits = n <= kSmallNode;
  const auto fetch = [&](int i, bool first) {
    if (fits && !first) return small[i];
    End e = endOf(model, model.branches[node.first_branch + i], scratch);
    if (!first) e.c = scratch.node_velocity[e.face];
    return e;
  };
  const auto store = [&](int i, const End& e) {
    if (fits)
      small[i] = e;
    else
      scratch.node_velocity[e.face] = e.c;
  };
  for (int i = 0; i < n; ++i) store(i, fetch(i, true));

  const double rho = model.density;
  double head = 0;
  double change = 1;
  int iteration = 0;
  do {
    double mass = source, admittance = 0, weighted = 0;
    for (int i = 0; i < n; ++i) {
      const End e = fetch(i, false);
      const double u = e.velocity(), a = e.area();
      const double y = a / (rho * e.c);
      mass += e.sign * a * u;
      admittance += y;
      weighted += y * (e.p_ref + e.pressure(rho) + 0.5 * rho * u * u - head);
    }
    // sum y (F − dH) = −mass; the first pass has no head yet: F counts from zero.
    const double d_head = (mass + weighted) / admittance;
    head += d_head;
    change = 0;
    for (int i = 0; i < n; ++i) {
      End e = fetch(i, false);
      const double u = e.velocity();
      const double f = e.p_ref + e.pressure(rho) + 0.5 * rho * u * u - head;
      const double step = bounded(-f / (4 * rho * margin(e, u)), e.c);
      e.c += step;
      const double relative = std::fabs(step) / e.c;
      change = relative > change ? relative : change;
      store(i, e);
    }
  } while (change > kTolerance && ++iteration < kMostIterations);

  double rate = 0;
  bool finite = true;
  for (int i = 0; i < n; ++i) {
    const End e = fetch(i, false);
    finite = finite && std::isfinite(e.c);
    const double here = writeEnd(model, e, e.velocity(), e.pressure(rho), scratch);
    rate = here > rate ? here : rate;
  }
  return finite && iteration < kMostIterations ? rate : -1;
}

}  // namespace vest::haemodynamics
