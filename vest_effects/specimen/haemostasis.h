#pragma once

#include <algorithm>
#include <cmath>

#include "vest_effects/bleeding/perfusion.h"
#include "vest_effects/bleeding/surface.h"
#include "vest_effects/bleeding/wounds.h"

/// How long bleeding lasts, for the test and for docs/validation.md: minutes, infinity where it does not stop
/// within an hour.
namespace vest::bleeding::haemostasis {

/// Until a clot holds a hole in the wall of a vessel of the shipped network.
/// @param area m² @param flow m³/s through it: 0 while pressure or a clamp stops it
inline double holeMinutes(const Vessels& vessels, int vessel, double area, double flow) {
  WoundState wounds;
  if (!open(vessels, {vessel, 0.05}, area, {}, wounds)) return INFINITY;
  haemodynamics::CirculationState state;
  state.hole_flow.fill(flow);
  for (int i = 1; i <= 360000; ++i) {
    book(vessels, state, 0.01, wounds);
    if (!(wounds.openings[0].open() > 0)) return i * 0.01 / 60;
  }
  return INFINITY;
}

/// Until a cut surface is dry: seeps a tenth of what it did at first. @param gauze pressed on it
inline double surfaceMinutes(bool gauze) {
  const float xyz[] = {0, 0, 0, 0.002f, 0, 0, 0, 0.002f, 0};
  const std::array<std::uint32_t, 3> triangle{0, 1, 2};
  SurfaceModel model;
  model.first = {0, 3}, model.scene = {3};
  model.perfusion.assign(3, 0.0045), model.depth.assign(3, 0.01);
  const SurfaceMesh mesh{xyz, &triangle, nullptr, 1};
  SurfaceState state = initialSurface(model);
  measureSurface(model, 0, mesh, xyz, state);
  openSurface(model, 0, xyz, {0, 0, 0}, 0.01, state);
  SurfaceInputs inputs;
  inputs.meshes = &mesh;
  SurfaceRunoff runoff(model);
  const float first = state.open[0];
  if (gauze) inputs.press[0] = {true, {0, 0, 0}, 0, 0.01};
  for (int i = 1; i <= 36000; ++i) {
    stepSurface(model, inputs, 0.1, state, runoff);
    if (state.open[0] <= 0.1f * first) return i * 0.1 / 60;
  }
  return INFINITY;
}

/// Tissue whose artery is shut for three minutes and then opens.
struct Release {
  double fall = 0;    ///< share of saturation in the first minute of the closure
  double lowest = 0;  ///< saturation
  double rise = 0;    ///< share a minute, the steepest
  double above = 0;   ///< saturation over that at rest, the most
  double back = 0;    ///< min until a quarter of that is left
};
inline Release release() {
  const std::uint32_t first[2] = {0, 2};
  double arterial = 0, drained = 1;
  const std::uint8_t fed[2] = {1, 1};
  PerfusionState state = initialPerfusion(2);
  const auto run = [&](double seconds) {
    for (int i = 0; i < std::lround(seconds / 0.04); ++i)
      stepPerfusion({first, 1, &arterial, &drained, fed}, 0.04, state);
    return static_cast<double>(state.saturation[0]);
  };
  Release r;
  r.fall = kAtRest - run(60);
  r.lowest = run(120);
  arterial = 1;
  double before = r.lowest;
  for (int at = 0; at < 600; ++at) {
    const double now = run(1);
    r.rise = std::max(r.rise, 60 * (now - before)), r.above = std::max(r.above, now - kAtRest);
    if (now > kAtRest + 0.15 / 4) r.back = at / 60.0;
    before = now;
  }
  return r;
}

}  // namespace vest::bleeding::haemostasis
