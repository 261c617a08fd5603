#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "boxes.h"

// Protects fluid under gravity: hydrostatics and the front of a dam that breaks, of particles and of pools;
// drops that hang on tissue and hold together.

namespace vest::fluid::specimen {
namespace {

/// No pools: particles alone.
Parameters particlesOnly() {
  Parameters p;
  p.rest_time = 1e6;
  p.capacity = 6000;
  return p;
}
void dry(Fluid& f) {
  std::fill(f.state.pools.bed.begin(), f.state.pools.bed.end(), kNoBed);
}

TEST(Column, PressesOnItsFloorWithItsWeightAndOnAWallWithHalfRhoGHSquared) {
  Parameters parameters = particlesOnly();
  parameters.iterations = 10;
  Fluid f(parameters, {openBox(-0.01, 0.01, -0.01, 0.01, 0.1, 4)});
  f.inputs.dt = 0.001;
  f.fill(-0.01, 0.01, -0.01, 0.01, 0, 0.04);
  f.step();
  dry(f);
  const double weight = static_cast<double>(f.state.particles.count) * f.model.whole * 1000 * 9.81;
  double floor = 0, wall = 0, time = 0;
  while (f.state.time < 0.5) {
    f.step();
    if (f.state.time < 0.25) continue;
    time += f.inputs.dt;
    floor += f.report.tissue_momentum[2];
    for (const Impact& i : f.report.impacts)
      if (i.momentum[0] > 0 && i.triangle >= 32) wall += i.momentum[0];
  }
  EXPECT_NEAR(-floor / time, weight, 0.01 * weight);
  double top = 0;
  for (std::size_t i = 0; i < f.state.particles.count; ++i)
    top = std::max(top, static_cast<double>(f.state.particles.z[i]));
  EXPECT_NEAR(top + 0.001, 0.04, 0.05 * 0.04) << "its height keeps";
  const double half = 0.5 * 1000 * 9.81 * 0.04 * 0.04 * 0.02;
  EXPECT_NEAR(wall / time, half, 0.25 * half)
      << "the surface layer's thickness is 5 % of the height on each side";
}

TEST(DamBreak, TheFrontOfParticlesFollowsMartinAndMoyce) {
  // A column a wide and 2 a high: Z = x/a over T = t sqrt(2 g/a); Martin and Moyce 1952, n² = 2: 2.33 at 1.98
  // and 3.44 at 2.83 (a dam without friction cannot be faster than dZ/dT = 2, Ritter 1892).
  const double a = 0.04;
  Parameters parameters = particlesOnly();
  parameters.iterations = 6;
  parameters.contact_angle_cosine = -1;  // a smooth dry channel: its narrow sides must not hold the water
  parameters.friction = 0;
  Fluid f(parameters, {openBox(0, 4.75 * a, -0.01, 0.01, 0.1, 12)});
  f.inputs.dt = 0.002;
  f.fill(0, a, -0.01, 0.01, 0, 2 * a);
  f.step();
  dry(f);
  const double scale = std::sqrt(2 * 9.81 / a);
  double z2 = 0, z3 = 0;
  while (z3 == 0) {
    f.step();
    std::vector<float> x(f.state.particles.x.begin(),
                         f.state.particles.x.begin() + static_cast<std::ptrdiff_t>(f.state.particles.count));
    std::nth_element(x.begin(), x.end() - 10, x.end());
    const double z = (static_cast<double>(x[x.size() - 10]) + 0.001) / a;
    if (z2 == 0 && f.state.time * scale >= 1.98) z2 = z;
    if (f.state.time * scale >= 2.83) z3 = z;
  }
  EXPECT_NEAR(z2, 2.33, 0.05 * 2.33);
  EXPECT_NEAR(z3, 3.44, 0.05 * 3.44);
}

/// A long tray with pools only.
Fluid tray(double length, double width, double cell) {
  Parameters p;
  p.low = {0, 0, -0.05};
  p.high = {length, width, 0.2};
  p.pool_cell = cell;
  Mesh m;
  m.add({-0.01, -0.01, 0}, {length + 0.02, 0, 0}, {0, width + 0.02, 0}, 4);
  return Fluid(p, {m});
}

TEST(Pool, ItsDamBreakFollowsRitter) {
  Fluid f = tray(0.8, 0.02, 0.004);
  f.step();
  for (int r = 0; r < f.model.rows; ++r)
    for (int c = 0; c < 100; ++c) fillCell(f.model, f.state, c, r, 0.02 * 0.004 * 0.004, 1);
  const double volume = poolVolume(f.model, f.state), h0 = 0.02, c0 = std::sqrt(9.81 * h0);
  double t = 0;
  while (t < 0.2) stepPools(f.model, 9.81, 0.002, f.state, f.scratch), t += 0.002;
  EXPECT_NEAR(poolVolume(f.model, f.state), volume, 1e-5 * volume);
  // h = (2 c0 − x/t)²/(9 g) between −c0 t and 2 c0 t (Ritter 1892); the tip is slowed by friction.
  double error = 0;
  for (int c = 0; c < f.model.columns; ++c) {
    const double x = (c + 0.5) * 0.004 - 0.4, s = x / t;
    const double h = s < -c0 ? h0 : (s > 2 * c0 ? 0 : (2 * c0 - s) * (2 * c0 - s) / (9 * 9.81));
    error += std::fabs(f.state.pools.depth[static_cast<std::size_t>(c)] - h) * 0.004;
  }
  EXPECT_LT(error / (h0 * 0.4), 0.03) << "mean deviation over the volume";
  const double at_dam = f.state.pools.depth[100];
  EXPECT_NEAR(at_dam, 4.0 / 9.0 * h0, 0.04 * h0);
}

TEST(Pool, ALakeOverAnUnevenBedStaysLevel) {
  Fluid f = tray(0.2, 0.2, 0.005);
  f.step();
  Pools& w = f.state.pools;
  for (int r = 0; r < f.model.rows; ++r) {
    for (int c = 0; c < f.model.columns; ++c) {
      const std::size_t i = static_cast<std::size_t>(r * f.model.columns + c);
      w.bed[i] = 0.002f * static_cast<float>((c * 7 + r * 3) % 9);
      w.depth[i] = std::max(0.0f, 0.012f - w.bed[i]);
    }
  }
  const auto before = w.depth;
  for (int k = 0; k < 200; ++k) stepPools(f.model, 9.81, 0.004, f.state, f.scratch);
  float worst = 0;
  for (std::size_t i = 0; i < before.size(); ++i) worst = std::max(worst, std::fabs(w.depth[i] - before[i]));
  EXPECT_LT(worst, 1e-7f);
}

TEST(Pool, AWaveTravelsWithSqrtGHAndComesBackFromTheWall) {
  Fluid f = tray(0.8, 0.02, 0.004);
  f.step();
  Pools& w = f.state.pools;
  const double h0 = 0.02, c0 = std::sqrt(9.81 * h0);
  for (int r = 0; r < f.model.rows; ++r)
    for (int c = 0; c < f.model.columns; ++c) {
      const double s = (c + 0.5) / 10;  // leans on the left wall: only one wave runs
      w.depth[static_cast<std::size_t>(r * f.model.columns + c)] =
          static_cast<float>(h0 + 0.0005 * std::max(0.0, 1 - s * s));
    }
  const auto crest = [&](int from, int to) {
    int best = from;
    for (int c = from; c < to; ++c)
      if (w.depth[static_cast<std::size_t>(c)] > w.depth[static_cast<std::size_t>(best)]) best = c;
    return (best + 0.5) * 0.004;
  };
  double t = 0;
  while (t < 0.8) stepPools(f.model, 9.81, 0.002, f.state, f.scratch), t += 0.002;
  EXPECT_NEAR(crest(50, 190), c0 * t, 0.03);
  while (t < 2.6) stepPools(f.model, 9.81, 0.002, f.state, f.scratch), t += 0.002;
  EXPECT_NEAR(crest(50, 190), 1.6 - c0 * t, 0.05) << "on its way back from the wall at 0.8 m";
  EXPECT_GT(w.depth[static_cast<std::size_t>(crest(50, 190) / 0.004)], h0 + 3e-5);
}

TEST(Pool, WhatHangsOverItTouchesNothing) {
  // Such instruments are not looked at: the same bits as without them, from just over the surface on.
  const auto after = [](int obstacles) {
    Fluid f = tray(0.08, 0.08, 0.004);
    f.step();
    fillCell(f.model, f.state, 5, 5, 0.02 * 0.004 * 0.004, 1);
    for (int k = 0; k < 200; ++k) {
      fluid::Obstacle& level = f.inputs.obstacles[0];
      fluid::Obstacle& aslant = f.inputs.obstacles[1];
      const double z = 0.0235 + 0.0005 * k;  // of its axis
      level.a = {0.0, 0.02, z}, level.b = {0.08, 0.025, z}, level.radius = 0.0025;
      aslant.a = {0.02, 0.02, z}, aslant.b = {0.09, 0.07, z + 0.05}, aslant.radius = 0.0025;
      f.inputs.obstacle_count = obstacles;
      f.step();
    }
    std::vector<std::uint8_t> bytes;
    fluid::save(f.state, bytes);
    return bytes;
  };
  EXPECT_TRUE(after(0) == after(2));
}

TEST(Pool, ItsSurfaceRisesByWhatAnInstrumentDisplacesAndFallsAgain) {
  // Archimedes: a shaft that stands in a tray takes the place of as much water as of it is under the surface.
  struct Shaft {
    std::array<double, 3> end;  // m
    const char* name;
  };
  for (const Shaft& shaft : {Shaft{{0.033, 0.041, 0.15}, "upright"}, Shaft{{0.1, 0.09, 0.08}, "aslant"}}) {
    Fluid f = tray(0.08, 0.08, 0.004);
    f.step();
    const double h0 = 0.02, radius = 0.0025, area = f.model.columns * f.model.rows * 0.004 * 0.004;
    for (int r = 0; r < f.model.rows; ++r)
      for (int c = 0; c < f.model.columns; ++c) fillCell(f.model, f.state, c, r, h0 * 0.004 * 0.004, 1);
    const double volume = poolVolume(f.model, f.state);
    fluid::Obstacle& o = f.inputs.obstacles[0];
    f.inputs.obstacle_count = 1, o.radius = radius, f.inputs.dt = 0.004;
    const auto run = [&](double seconds, double from, double to) {  // m: height of its tip
      for (double t = 0; t < seconds; t += f.inputs.dt) {
        // Slowly from rest to rest: waves of so deep a pool would run for a minute.
        const double part = std::min(1.0, t / 4.0), z = from + (to - from) * part * part * (3 - 2 * part);
        o.a = {0.033, 0.041, z}, o.b = {shaft.end[0], shaft.end[1], shaft.end[2] + z};
        f.step();
      }
    };
    const auto level = [&](float& low, float& high) {  // their mean
      low = 1, high = 0;
      double sum = 0;
      const Pools& w = f.state.pools;
      for (std::size_t i = 0; i < w.depth.size(); ++i)
        low = std::min(low, w.top(i)), high = std::max(high, w.top(i)), sum += static_cast<double>(w.top(i));
      return sum / static_cast<double>(w.depth.size());
    };
    run(6.0, 0.03, 0.004);
    float low, high;
    const double mean = level(low, high), dz = shaft.end[2],
                 length = std::sqrt((shaft.end[0] - 0.033) * (shaft.end[0] - 0.033) +
                                    (shaft.end[1] - 0.041) * (shaft.end[1] - 0.041) + dz * dz);
    // Its axis from tip to surface, and the half ball at the tip.
    const double under = 3.14159265 * radius * radius * ((mean - 0.004) * length / dz + 2.0 / 3 * radius);
    EXPECT_NEAR(mean - h0, under / area, 0.05 * under / area) << shaft.name;
    EXPECT_LT(high - low, 5e-5f) << shaft.name << ": the pool is level about it";
    EXPECT_NEAR(poolVolume(f.model, f.state), volume, 1e-5 * volume) << shaft.name;
    run(6.0, 0.004, 0.05);
    level(low, high);
    EXPECT_NEAR(low, h0, 5e-5) << shaft.name;
    EXPECT_NEAR(high, h0, 5e-5) << shaft.name;
  }
}

TEST(Drop, HangsOnTissueAboveItAndALargerOneFalls) {
  for (const double side : {0.002, 0.016}) {
    Mesh ceiling;
    ceiling.add({-0.05, 0.05, 0.1}, {0.1, 0, 0}, {0, -0.1, 0}, 4);  // its outside faces down
    Fluid f(particlesOnly(), {ceiling});
    f.fill(-side / 2, side / 2, -side / 2, side / 2, 0.1 - side, 0.1, 0);
    for (int k = 0; k < 125; ++k) f.step();
    double hanging = 0;
    for (std::size_t i = 0; i < f.state.particles.count; ++i)
      hanging += f.state.particles.z[i] > 0.09f ? f.model.whole : 0;
    if (side < 0.01) {
      EXPECT_NEAR(hanging, f.model.whole, 1e-12);
    } else {
      EXPECT_LT(hanging, 0.7 * f.state.emitted)
          << "a pendant drop is of the order of the capillary length, 2.7 mm";
    }
  }
}

}  // namespace
}  // namespace vest::fluid::specimen
