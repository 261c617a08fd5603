#include "vest_effects/haemodynamics/step.h"

#include <algorithm>
#include <cmath>

#ifdef _OPENMP
#include <omp.h>
#endif

#include "kernel.h"
#include "local.h"
#include "nodes.h"

namespace vest::haemodynamics {

namespace {

constexpr double kCourant = 0.9;  // MUSCL-Hancock is stable up to 1

kernel::SegmentView view(const Model& model, int segment, State& state, Scratch& scratch) {
  const SegmentModel& s = model.segments[segment];
  const int c = s.first_cell, f = s.first_face;
  kernel::SegmentView v;
  v.cells = s.cells;
  v.inv_dx = 1 / s.dx;
  v.inv_density = 1 / model.density;
  v.friction = model.friction;
  v.sqrt_area_ref = &model.sqrt_area_ref[c];
  v.beta = &model.beta[c];
  v.face_sqrt_area_ref = &model.face_sqrt_area_ref[f];
  v.face_inv_beta = &model.face_inv_beta[f];
  v.face_half_rho_beta = &model.face_half_rho_beta[f];
  v.area = &state.area[c];
  v.velocity = &state.velocity[c];
  v.pressure = &scratch.pressure[c];
  v.inv_area = &scratch.inv_area[c];
  v.p_left = &scratch.p_left[c];
  v.u_left = &scratch.u_left[c];
  v.p_right = &scratch.p_right[c];
  v.u_right = &scratch.u_right[c];
  v.flux_area = &scratch.flux_area[f];
  v.flux_velocity = &scratch.flux_velocity[f];
  v.speeds = &scratch.speeds[f];
  return v;
}

struct Check {
  Status status = Status::kOk;
  int segment = -1;
  double rate = 0;  // greatest (|U| + c)/dx
};

Check check(const Model& model, bool with_rate, State& state, Scratch& scratch) {
  Check result;
  const kernel::Kernels& kernels = kernel::selected();
  for (std::size_t k = 0; k < model.segments.size(); ++k) {
    const kernel::SegmentView v = view(model, static_cast<int>(k), state, scratch);
    const double rate = with_rate ? kernels.survey(v) : 0;
    result.rate = std::max(result.rate, rate);
    if (with_rate ? std::isfinite(rate) : kernels.stray(v) == 0) continue;
    const SegmentModel& s = model.segments[k];
    result.status = Status::kSupercritical;
    result.segment = static_cast<int>(k);
    for (int i = s.first_cell; i < s.first_cell + s.cells; ++i) {
      if (!(state.area[i] > 0 && std::isfinite(state.area[i]) && std::isfinite(state.velocity[i])))
        result.status = Status::kNotFinite;
    }
    break;
  }
  return result;
}

bool good(const Model& model, const Inputs& in, double dt) {
  bool ok = dt >= 0 && dt <= 3600 && in.heart_rate_scale >= 0 &&
            in.heart_rate_scale * dt <= 100 * model.period && std::isfinite(in.flow_scale) &&
            in.resistance_scale > 0 && std::isfinite(in.resistance_scale) &&
            std::isfinite(in.outflow_pressure_offset) && in.hole_count >= 0 && in.hole_count <= kMostHoles &&
            in.closure_count >= 0 && in.closure_count <= kMostClosures;
  const int segments = static_cast<int>(model.segments.size());
  for (int i = 0; ok && i < in.hole_count; ++i) {
    const Hole& h = in.holes[i];
    ok = h.segment >= 0 && h.segment < segments && h.station >= 0 &&
         h.station <= model.segments[h.segment].length && h.area >= 0 && std::isfinite(h.area) &&
         h.discharge >= 0 && h.discharge <= 1 && std::isfinite(h.external_pressure);
  }
  for (int i = 0; ok && i < in.closure_count; ++i) {
    const Closure& c = in.closures[i];
    ok = c.segment >= 0 && c.segment < segments && c.station >= 0 &&
         c.station <= model.segments[c.segment].length && c.opening >= 0 && c.opening <= 1;
  }
  return ok;
}

void copyArrays(const State& from, State& to) {
  to.time = from.time;
  to.phase = from.phase;
  to.hole_flow = from.hole_flow;
  // Equal sizes: copies without allocating.
  std::copy(from.area.begin(), from.area.end(), to.area.begin());
  std::copy(from.velocity.begin(), from.velocity.end(), to.velocity.begin());
  std::copy(from.windkessel_pressure.begin(), from.windkessel_pressure.end(), to.windkessel_pressure.begin());
  std::copy(from.node_volume.begin(), from.node_volume.end(), to.node_volume.begin());
  std::copy(from.leak_volume.begin(), from.leak_volume.end(), to.leak_volume.begin());
}

// Cuts `weights` into parts of about equal sum.
std::vector<int> cut(const std::vector<int>& weights, int parts) {
  long total = 0;
  for (int w : weights) total += w;
  std::vector<int> bounds{0};
  long sum = 0;
  for (std::size_t i = 0; i < weights.size() && static_cast<int>(bounds.size()) < parts; ++i) {
    sum += weights[i];
    if (sum * parts >= total * static_cast<long>(bounds.size())) bounds.push_back(static_cast<int>(i + 1));
  }
  while (static_cast<int>(bounds.size()) <= parts) bounds.push_back(static_cast<int>(weights.size()));
  return bounds;
}

/// What the threads share during one step.
struct Shared {
  double remaining = 0, rate = 0, dt = 0, inflow = 0;
  int substeps = 0;
  bool done = false;
  Status status = Status::kOk;
  int segment = -1;
};

void planSubstep(const Model& model, const Inputs& inputs, State& state, Scratch& scratch, Shared& shared) {
  if (shared.substeps > 0) {
    shared.rate = 0;
    for (int part = 0; part < scratch.threads; ++part) {
      shared.rate = std::max(shared.rate, scratch.rate[part]);
      if (scratch.failed_segment[part] >= 0 && shared.status == Status::kOk) {
        shared.status = Status::kNotConverged;
        shared.segment = scratch.failed_segment[part];
      }
    }
  }
  const double count = std::ceil(shared.remaining * shared.rate / kCourant);
  if (shared.status == Status::kOk && !(count <= kMostSubsteps && shared.rate * kLeastSubstep <= kCourant))
    shared.status = Status::kTooManySubsteps;
  if (shared.status == Status::kOk && shared.substeps >= kMostSubsteps)
    shared.status = Status::kTooManySubsteps;
  shared.done = shared.remaining <= 0 || shared.status != Status::kOk;
  if (shared.done) return;
  shared.dt = count > 1 ? shared.remaining / count : shared.remaining;
  shared.remaining = count > 1 ? shared.remaining - shared.dt : 0;
  // The mean over the sub-step: what flows in is the curve's integral.
  const double ahead = state.phase + shared.dt * inputs.heart_rate_scale;
  shared.inflow = inputs.flow_scale *
                  (ahead > state.phase
                       ? (model.inflowVolume(ahead) - model.inflowVolume(state.phase)) / (ahead - state.phase)
                       : model.inflowAt(state.phase));
  state.phase = ahead;
  while (state.phase >= model.period) state.phase -= model.period;
  state.time += shared.dt;
  ++shared.substeps;
  std::fill(scratch.rate.begin(), scratch.rate.end(), 0.0);
}

// Value at a segment's middle from its cells' means; of fourth order where there are cells enough.
double atMiddle(const double* v, int cells) {
  const int i = cells / 2;
  if (cells % 2 == 1) return (26 * v[i] - v[i - 1] - v[i + 1]) / 24;
  if (cells == 2) return 0.5 * (v[0] + v[1]);
  return (7 * (v[i - 1] + v[i]) - (v[i - 2] + v[i + 1])) / 12;
}

}  // namespace

const char* toText(Status status) {
  switch (status) {
    case Status::kOk:
      return "ok";
    case Status::kBadInput:
      return "an input is out of range";
    case Status::kTooManySubsteps:
      return "too many sub-steps are needed (cells too small or walls too stiff)";
    case Status::kNotConverged:
      return "the equations of a node have no solution near by";
    case Status::kSupercritical:
      return "the flow is as fast as the waves, outside the model";
    case Status::kNotFinite:
      return "a value is not finite or an area not positive";
  }
  return "unknown";
}

Scratch::Scratch(const Model& model, int wanted)
    : threads(std::clamp(wanted, 1, 256)),
      pressure(model.cells),
      inv_area(model.cells),
      p_left(model.cells),
      u_left(model.cells),
      p_right(model.cells),
      u_right(model.cells),
      flux_area(model.face_inv_beta.size()),
      flux_velocity(model.face_inv_beta.size()),
      speeds(model.face_inv_beta.size()),
      node_pressure_p(model.face_inv_beta.size()),
      node_velocity(model.face_inv_beta.size()),
      rate(threads),
      failed_segment(threads, -1),
      backup(initialState(model)) {
  std::vector<int> cells, branches;
  for (const auto& s : model.segments) cells.push_back(s.cells);
  for (const auto& n : model.nodes) branches.push_back(n.branches);
  segment_range = cut(cells, threads);
  node_range = cut(branches, threads);
}

State initialState(const Model& model) {
  State state;
  state.area.resize(model.cells);
  state.velocity.assign(model.cells, 0);
  for (int i = 0; i < model.cells; ++i) state.area[i] = model.sqrt_area_ref[i] * model.sqrt_area_ref[i];
  state.windkessel_pressure.assign(model.nodes.size(), 0);
  for (std::size_t n = 0; n < model.nodes.size(); ++n) {
    if (model.nodes[n].kind == NodeKind::kTerminal)
      state.windkessel_pressure[n] =
          model.segments[model.branches[model.nodes[n].first_branch].segment].reference_pressure;
  }
  state.node_volume.assign(model.nodes.size(), 0);
  state.leak_volume.assign(model.segments.size(), 0);
  return state;
}

void setUniformPressure(const Model& model, double pressure, State& state) {
  for (const auto& s : model.segments) {
    for (int i = s.first_cell; i < s.first_cell + s.cells; ++i) {
      const double root = model.sqrt_area_ref[i] + (pressure - s.reference_pressure) / model.beta[i];
      state.area[i] = root * root;
      state.velocity[i] = 0;
    }
  }
  for (std::size_t n = 0; n < model.nodes.size(); ++n) {
    if (model.nodes[n].kind == NodeKind::kTerminal) state.windkessel_pressure[n] = pressure;
  }
}

StepReport step(const Model& model, const Inputs& inputs, double dt, State& state, Scratch& scratch) {
  StepReport report;
  if (!good(model, inputs, dt)) {
    report.status = Status::kBadInput;
    return report;
  }
  const Check before = check(model, true, state, scratch);
  if (before.status != Status::kOk) {
    report.status = before.status;
    report.segment = before.segment;
    return report;
  }
  copyArrays(state, scratch.backup);
  for (int i = 0; i < kMostHoles; ++i) state.hole_flow[i] = 0;
  std::fill(scratch.failed_segment.begin(), scratch.failed_segment.end(), -1);
  const kernel::Kernels& kernels = kernel::selected();
  Shared shared;
  shared.remaining = dt;
  shared.rate = before.rate;

  const auto plan = [&] { planSubstep(model, inputs, state, scratch, shared); };
  const auto findFluxes = [&](int part) {
    for (int k = scratch.segment_range[part]; k < scratch.segment_range[part + 1]; ++k) {
      const double rate = kernels.fluxes(view(model, k, state, scratch), shared.dt);
      scratch.rate[part] = std::max(scratch.rate[part], rate);
      for (int i = 0; i < inputs.closure_count; ++i) {
        if (inputs.closures[i].segment == k) applyClosure(model, inputs, i, scratch);
      }
    }
  };
  const auto solveNodes = [&](int part) {
    for (int n = scratch.node_range[part]; n < scratch.node_range[part + 1]; ++n) {
      const double rate = solveNode(model, inputs, n, shared.inflow, shared.dt, state, scratch);
      if (rate < 0 && scratch.failed_segment[part] < 0)
        scratch.failed_segment[part] = model.branches[model.nodes[n].first_branch].segment;
      scratch.rate[part] = std::max(scratch.rate[part], rate);
    }
  };
  const auto updateCells = [&](int part) {
    for (int k = scratch.segment_range[part]; k < scratch.segment_range[part + 1]; ++k) {
      kernels.update(view(model, k, state, scratch), shared.dt);
      for (int i = 0; i < inputs.closure_count; ++i) {
        if (inputs.closures[i].segment == k) finishClosure(model, inputs, i, shared.dt, state, scratch);
      }
      for (int i = 0; i < inputs.hole_count; ++i) {
        if (inputs.holes[i].segment == k)
          state.hole_flow[i] += leak(model, inputs.holes[i], shared.dt, state) / dt;
      }
    }
  };
  if (scratch.threads == 1) {  // without a team: its barriers cost as much as a small network's cells
    for (plan(); !shared.done; plan()) findFluxes(0), solveNodes(0), updateCells(0);
  } else {
#pragma omp parallel num_threads(scratch.threads)
    {
#ifdef _OPENMP
      const int self = omp_get_thread_num(), team = omp_get_num_threads();
#else
      const int self = 0, team = 1;
#endif
      for (;;) {
#pragma omp single
        plan();
        // (the end of `single` is a barrier)
        if (shared.done) break;
        for (int part = self; part < scratch.threads; part += team) findFluxes(part);
#pragma omp barrier
        for (int part = self; part < scratch.threads; part += team) solveNodes(part);
#pragma omp barrier
        for (int part = self; part < scratch.threads; part += team) updateCells(part);
#pragma omp barrier
      }
    }
  }

  Check after;
  after.status = shared.status;
  after.segment = shared.segment;
  if (after.status == Status::kOk) after = check(model, false, state, scratch);
  if (after.status != Status::kOk) copyArrays(scratch.backup, state);
  report.status = after.status;
  report.segment = after.segment;
  report.substeps = shared.substeps;
  return report;
}

bool sample(const Model& model, const Inputs& inputs, const State& state, Scratch& scratch,
            std::vector<SegmentSample>& out) {
  // The kernels with dt = 0 reconstruct without changing anything.
  copyArrays(state, scratch.backup);
  State& copy = scratch.backup;
  for (std::size_t k = 0; k < model.segments.size(); ++k)
    kernel::selected().fluxes(view(model, static_cast<int>(k), copy, scratch), 0);
  const double inflow = inputs.flow_scale * model.inflowAt(state.phase);
  bool solved = true;
  for (std::size_t n = 0; n < model.nodes.size(); ++n)
    solved = solveNode(model, inputs, static_cast<int>(n), inflow, 0, copy, scratch) >= 0 && solved;

  for (std::size_t k = 0; k < model.segments.size(); ++k) {
    const SegmentModel& s = model.segments[k];
    const auto at_face = [&](int face) {
      const double p = scratch.node_pressure_p[face];
      const double root = model.face_sqrt_area_ref[face] + p * model.face_inv_beta[face];
      return Sample{s.reference_pressure + p, scratch.flux_area[face], root * root};
    };
    out[k].proximal = at_face(s.first_face);
    out[k].distal = at_face(s.first_face + s.cells);
    const double p = atMiddle(&scratch.pressure[s.first_cell], s.cells);
    const double u = atMiddle(&state.velocity[s.first_cell], s.cells);
    const double root = s.sqrt_area_ref_mid + p / s.beta_mid;
    out[k].middle = {s.reference_pressure + p, root * root * u, root * root};
  }
  return solved;
}

double volume(const Model& model, const State& state) {
  double sum = 0;
  for (const auto& s : model.segments) {
    double areas = 0;
    for (int i = s.first_cell; i < s.first_cell + s.cells; ++i) areas += state.area[i];
    sum += areas * s.dx;
  }
  return sum;
}

}  // namespace vest::haemodynamics
