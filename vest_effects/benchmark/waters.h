#pragma once

#include <algorithm>

#include "boxes.h"

/// Fluids whose speed is told.
namespace vest::fluid::bench {

/// Irrigation as in the trainer: 3 l/min on a plate.
inline specimen::Fluid irrigation() {
  specimen::Fluid f(Parameters{}, {specimen::plate(0.15)});
  f.inputs.source_count = 1;
  f.inputs.sources[0].area = 1.9635e-5;
  f.inputs.sources[0].flow = 5e-5;
  f.inputs.sources[0].direction = {0.3, 0, -1};
  f.inputs.sources[0].position = {0, 0, 0.08};
  while (f.state.time < 0.5) f.step();
  return f;
}

/// A dense block that breaks and comes to rest: every particle has all its neighbours. Nothing joins a pool.
inline specimen::Fluid denseBlock(int iterations) {
  Parameters p;
  p.capacity = 20000, p.rest_time = 1e6, p.iterations = iterations;
  specimen::Fluid f(p, {specimen::openBox(-0.04, 0.06, -0.03, 0.03, 0.15, 6)});
  f.fill(-0.04, 0.0, -0.03, 0.03, 0, 0.06);
  f.step();
  std::fill(f.state.pools.bed.begin(), f.state.pools.bed.end(), kNoBed);
  return f;
}

/// Water about 13 mm deep, with ripples, over a third of the field.
inline specimen::Fluid poolOfTheCavity() {
  specimen::Mesh m;
  m.add({-0.2, -0.24, 0}, {0.4, 0, 0}, {0, 0.48, 0}, 10);
  specimen::Fluid f(Parameters{}, {m});
  f.step();
  for (int r = 20; r < 90; ++r)
    for (int c = 20; c < 80; ++c)
      fillCell(f.model, f.state, c, r, 0.01 * 1.6e-5 * (1 + 0.1 * ((r + c) % 7)), 1);
  return f;
}

}  // namespace vest::fluid::bench
