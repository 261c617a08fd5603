#pragma once

// Small networks of round numbers for the tests of haemodynamics.

#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "vest_effects/haemodynamics/step.h"

namespace vest::haemodynamics::testing {

constexpr double kPi = 3.14159265358979323846;

/// E = 400 kPa, wall a tenth of the radius, blood of 1060 kg/m³; no friction unless set.
inline Network blankNetwork() {
  Network n;
  n.viscosity = 0;
  n.inflow = {{0, 0, 2}};
  return n;
}

inline SegmentSpec& addSegment(Network& n, long in, long out, double length, double r_prox, double r_dist) {
  SegmentSpec s;
  s.id = std::to_string(n.segments.size() + 1);
  s.name = "segment_" + s.id;
  s.node_in = in;
  s.node_out = out;
  s.length = length;
  s.radius_proximal = r_prox;
  s.radius_distal = r_dist;
  s.wall_proximal = 0.1 * r_prox;
  s.wall_distal = 0.1 * r_dist;
  s.youngs_modulus = 4e5;
  s.reference_pressure = 10000;
  s.line = static_cast<int>(n.segments.size()) + 2;
  n.segments.push_back(s);
  return n.segments.back();
}

/// Moens and Korteweg with Poisson's ratio 1/2: c² = 2 E h/(3 rho r).
inline double waveSpeed(const Network& n, const SegmentSpec& s) {
  return std::sqrt(2 * s.youngs_modulus * s.wall_proximal / (3 * n.density * s.radius_proximal));
}

inline double area(const SegmentSpec& s) {
  return kPi * s.radius_proximal * s.radius_proximal;
}

/// rho c/A: a terminal of this resistance swallows small waves.
inline double impedance(const Network& n, const SegmentSpec& s) {
  return n.density * waveSpeed(n, s) / area(s);
}

inline void endMatched(Network& n, SegmentSpec& s) {
  s.terminal = true;
  s.load = {impedance(n, s), 0, 0, s.reference_pressure};
}

/// A smooth hump of flow, (1 − cos)/2, from 0 to `width` seconds.
inline void setHump(Network& n, double height, double width) {
  n.inflow.clear();
  const int points = 3000;
  for (int i = 0; i <= points; ++i) {
    const double share = static_cast<double>(i) / points;
    n.inflow.push_back({share * width, 0.5 * height * (1 - std::cos(2 * kPi * share)), i + 2});
  }
  n.inflow.push_back({n.period, 0, points + 3});
}

inline void setSteady(Network& n, double flow) {
  n.inflow = {{0, flow, 2}, {n.period, flow, 3}};
}

/// Runs for `duration` and keeps every segment's sample each `interval`.
inline Status run(const Model& model, const Inputs& inputs, double duration, double interval, State& state,
                  std::vector<std::vector<SegmentSample>>* history = nullptr, int threads = 1) {
  Scratch scratch(model, threads);
  std::vector<SegmentSample> now(model.segments.size());
  const int steps = static_cast<int>(duration / interval + 0.5);
  for (int i = 0; i < steps; ++i) {
    if (history) {
      if (!sample(model, inputs, state, scratch, now)) return Status::kNotConverged;
      history->push_back(now);
    }
    const StepReport report = step(model, inputs, interval, state, scratch);
    if (report.status != Status::kOk) return report.status;
  }
  return Status::kOk;
}

/// Trunk, two daughters, and one more generation that joins again: a tree with a loop, tapering, with
/// friction.
inline Network mixedNetwork() {
  Network n = blankNetwork();
  n.viscosity = 0.004;
  addSegment(n, 1, 2, 0.2, 0.010, 0.008);
  addSegment(n, 2, 3, 0.15, 0.006, 0.005);
  addSegment(n, 2, 4, 0.10, 0.005, 0.005);
  addSegment(n, 3, 5, 0.08, 0.004, 0.004);
  addSegment(n, 3, 5, 0.12, 0.003, 0.003);
  addSegment(n, 5, 6, 0.006, 0.005, 0.0045);
  for (int i : {2, 5}) {
    n.segments[i].terminal = true;
    n.segments[i].load = {5e7, 3e8, 2e-9, 500};
  }
  setHump(n, 2e-4, 0.3);
  return n;
}

}  // namespace vest::haemodynamics::testing
