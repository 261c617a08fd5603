#include <gtest/gtest.h>

#include <cmath>

#include "boxes.h"

// Protects jets: speed by continuity, flight by ballistics, force on a plate by the change of momentum,
// splashes that keep mass.

namespace vest::fluid::specimen {
namespace {

constexpr double kPi = 3.14159265358979;

Source irrigator() {
  Source s;
  s.area = kPi * 0.0025 * 0.0025;
  s.flow = 5e-5;  // 3 l/min through 5 mm: 2.546 m/s
  s.blood = 0;
  return s;
}

TEST(Jet, ItsSpeedIsFlowOverArea) {
  Fluid f(Parameters{}, {});
  f.inputs.gravity = {0, 0, 0};
  f.inputs.source_count = 1;
  f.inputs.sources[0] = irrigator();
  f.inputs.sources[0].direction = {0, 1, 0};
  f.inputs.sources[0].position = {0, -0.2, 0.1};
  double volume = 0;
  for (int k = 0; k < 25; ++k) f.step();
  double speed = 0;
  const Particles& p = f.state.particles;
  for (std::size_t i = 0; i < p.count; ++i)
    speed += p.vy[i] / static_cast<double>(p.count), volume += f.model.whole;
  EXPECT_NEAR(speed, 2.546, 0.02 * 2.546);
  EXPECT_NEAR(volume, 5e-5 * 0.1, f.model.whole);
}

TEST(Jet, FliesAsFarAsBallisticsSay) {
  // From 0.15 m height, level: it lands on z = 0 after sqrt(2 h/g), at v sqrt(2 h/g).
  Parameters parameters;
  parameters.low = {-0.1, -0.3, -0.1};
  parameters.high = {0.1, 0.6, 0.3};
  Fluid f(parameters, {});
  f.inputs.source_count = 1;
  f.inputs.sources[0] = irrigator();
  f.inputs.sources[0].direction = {0, 1, 0};
  f.inputs.sources[0].position = {0, 0, 0.15};
  for (int k = 0; k < 60; ++k) f.step();
  const Particles& p = f.state.particles;
  const double t_land = std::sqrt(2 * 0.15 / 9.81), range = 2.546 * t_land;
  double sum = 0;
  int count = 0;
  for (std::size_t i = 0; i < p.count; ++i) {
    if (std::fabs(p.z[i]) > 0.004f) continue;
    sum += static_cast<double>(p.y[i]) + static_cast<double>(p.z[i]) * 2.546 / (9.81 * t_land);  // to z = 0
    ++count;
  }
  ASSERT_GT(count, 3);
  EXPECT_NEAR(sum / count, range, 0.02 * range);
}

TEST(Jet, PressesOnAPlateWithRhoQV) {
  for (const double dt : {0.004, 0.002}) {
    Fluid f(Parameters{}, {plate(0.15)});
    f.inputs.dt = dt;
    f.inputs.gravity = {0, 0, 0};
    f.inputs.source_count = 1;
    f.inputs.sources[0] = irrigator();
    f.inputs.sources[0].direction = {0, 0, -1};
    f.inputs.sources[0].position = {0, 0, 0.05};
    double momentum = 0, time = 0;
    while (f.state.time < 0.4) {
      f.step();
      if (f.state.time < 0.15) continue;
      momentum += f.report.tissue_momentum[2];
      time += dt;
    }
    const double force = 1000 * 5e-5 * 2.546;  // 0.127 N
    EXPECT_NEAR(-momentum / time, force, 0.05 * force) << "dt " << dt;
  }
}

TEST(Jet, OfBloodPressesAsMuchHarderAsItIsDenser) {
  double force[2];
  for (const int blood : {0, 1}) {
    Parameters parameters;
    parameters.blood_viscosity = parameters.water_viscosity,
    parameters.blood_tension = parameters.water_tension;
    Fluid f(parameters, {plate(0.15)});
    f.inputs.source_count = 1;
    f.inputs.sources[0] = irrigator();
    f.inputs.sources[0].blood = blood;
    f.inputs.sources[0].direction = {0, 0, -1};
    f.inputs.sources[0].position = {0, 0, 0.05};
    double momentum = 0;
    for (int k = 0; k < 60; ++k) f.step(), momentum -= f.report.tissue_momentum[2];
    force[blood] = momentum;
  }
  EXPECT_NEAR(force[1] / force[0], 1.06, 1e-4) << "the same motion";
}

TEST(Jet, SplashesKeepMassAndTakeMomentumFromTheTissueOnly) {
  Parameters parameters;
  parameters.rest_time = 1e6;
  Fluid f(parameters, {plate(0.15)});
  f.inputs.gravity = {0, 0, 0};
  f.step();
  Particles& p = f.state.particles;
  p.count = 1;
  p.x[0] = 0.011f, p.y[0] = 0.013f, p.z[0] = 0.006f, p.vx[0] = 0.5f, p.vy[0] = 0, p.vz[0] = -2.5f;
  p.volume[0] = 1, p.blood[0] = 1, p.age[0] = p.rest[0] = 0;
  f.state.emitted = f.model.whole;
  const double mass = f.model.whole * f.model.parameters.blood_density;
  double before[3] = {0.5 * mass, 0, -2.5 * mass}, given[3] = {0, 0, 0};
  for (int k = 0; k < 3; ++k) {
    f.step();
    for (int a = 0; a < 3; ++a) given[a] += f.report.tissue_momentum[a];
  }
  EXPECT_EQ(p.count, 3U) << "one drop and two small ones";
  EXPECT_NEAR(particleVolume(f.model, f.state), f.model.whole, 1e-6 * f.model.whole);
  double now[3] = {0, 0, 0};
  for (std::size_t i = 0; i < p.count; ++i) {
    const double m = mass * static_cast<double>(p.volume[i]);
    now[0] += m * p.vx[i], now[1] += m * p.vy[i], now[2] += m * p.vz[i];
  }
  for (int a = 0; a < 3; ++a) EXPECT_NEAR(now[a] + given[a], before[a], 1e-5 * mass * 2.5) << "axis " << a;
}

TEST(Jet, DoesNotPassThroughTissueThatComesTowardsIt) {
  Fluid f(Parameters{}, {plate(0.05)});
  f.inputs.source_count = 1;
  f.inputs.sources[0] = irrigator();
  f.inputs.sources[0].direction = {0, 0, -1};
  f.inputs.sources[0].position = {0, 0, 0.08};
  for (int k = 0; k < 50; ++k) {
    for (std::size_t i = 2; i < f.meshes[0].positions.size(); i += 3) f.meshes[0].positions[i] += 0.0005f;
    f.step();
    const float floor = f.meshes[0].positions[2];
    for (std::size_t i = 0; i < f.state.particles.count; ++i) {
      if (std::fabs(f.state.particles.x[i]) > 0.045f || std::fabs(f.state.particles.y[i]) > 0.045f) continue;
      EXPECT_GT(f.state.particles.z[i], floor - 0.0005f) << "step " << k;
    }
  }
}

TEST(Jet, AnInstrumentInItsWayTurnsItAside) {
  // A jet of 2.5 m/s upon a shaft of 5 mm across it: 10 mm of way in a step, and none of it gets through.
  const auto beyond = [](bool shaft) {
    Fluid f(Parameters{}, {plate(0.1, -0.02)});
    f.inputs.gravity = {0, 0, -1e-3};
    f.inputs.source_count = 1;
    f.inputs.sources[0].position = {-0.06, 0, 0.1};
    f.inputs.sources[0].direction = {1, 0, 0};
    f.inputs.sources[0].area = 1e-6, f.inputs.sources[0].flow = 2.5e-6;
    f.inputs.obstacle_count = shaft;
    f.inputs.obstacles[0] = {{0, -0.1, 0.1}, {0, 0.1, 0.1001}, 0.0025, {}};
    for (int k = 0; k < 25; ++k) f.step();
    double through = 0;
    for (std::size_t i = 0; i < f.state.particles.count; ++i)
      if (f.state.particles.x[i] > 0.02f)
        through += f.model.whole * static_cast<double>(f.state.particles.volume[i]);
    EXPECT_LT(std::fabs(f.gap()), 1e-4 * f.state.emitted);
    return through / f.state.emitted;
  };
  EXPECT_GT(beyond(false), 0.5);
  EXPECT_LT(beyond(true), 0.02) << "of all its fluid";
}

}  // namespace
}  // namespace vest::fluid::specimen
