// Particle-steps a second on one thread (the PositionBasedDynamics library does 0.15 M; floor 3 times, aim
// 10), and what pools, smoke and lens cost.

#include <benchmark/benchmark.h>

#include <algorithm>

#include "boxes.h"
#include "vest_effects/smoke/smoke.h"

namespace {

using namespace vest::fluid;

void report(benchmark::State& bench, double steps) {
  bench.counters["Mparticle_steps/s"] = benchmark::Counter(1e-6 * steps, benchmark::Counter::kIsRate);
  bench.counters["times_PBD_0.15M/s"] = benchmark::Counter(steps / 0.15e6, benchmark::Counter::kIsRate);
}

/// Irrigation as in the trainer: 3 l/min on a plate.
void Irrigation(benchmark::State& bench) {
  test::Fluid f(Parameters{}, {test::plate(0.15)});
  f.inputs.source_count = 1;
  f.inputs.sources[0].area = 1.9635e-5;
  f.inputs.sources[0].flow = 5e-5;
  f.inputs.sources[0].direction = {0.3, 0, -1};
  f.inputs.sources[0].position = {0, 0, 0.08};
  while (f.state.time < 0.5) f.step();
  double steps = 0;
  for (auto _ : bench) {
    f.step();
    steps += static_cast<double>(f.state.particles.count);
  }
  bench.counters["particles"] = static_cast<double>(f.state.particles.count);
  report(bench, steps);
}
BENCHMARK(Irrigation)
    ->Iterations(400)
    ->Unit(benchmark::kMillisecond);  // the film grows: the same span each time

/// A dense block that breaks and comes to rest: every particle has all its neighbours.
void DenseBlock(benchmark::State& bench) {
  Parameters p;
  p.capacity = 20000, p.rest_time = 1e6, p.iterations = static_cast<int>(bench.range(0));
  test::Fluid f(p, {test::openBox(-0.04, 0.06, -0.03, 0.03, 0.15, 6)});
  f.fill(-0.04, 0.0, -0.03, 0.03, 0, 0.06);
  f.step();
  std::fill(f.state.pools.bed.begin(), f.state.pools.bed.end(), kNoBed);
  double steps = 0;
  for (auto _ : bench) {
    f.step();
    steps += static_cast<double>(f.state.particles.count);
  }
  bench.counters["particles"] = static_cast<double>(f.state.particles.count);
  report(bench, steps);
}
BENCHMARK(DenseBlock)->Arg(3)->Arg(5)->Unit(benchmark::kMillisecond);

void PoolOfTheCavity(benchmark::State& bench) {
  Parameters p;
  test::Mesh m;
  m.add({-0.2, -0.24, 0}, {0.4, 0, 0}, {0, 0.48, 0}, 10);
  test::Fluid f(p, {m});
  f.step();
  for (int r = 20; r < 90; ++r)
    for (int c = 20; c < 80; ++c)
      fillCell(f.model, f.state, c, r, 0.01 * 1.6e-5 * (1 + 0.1 * ((r + c) % 7)), 1);
  for (auto _ : bench) stepPools(f.model, 9.81, 0.004, f.state, f.scratch);
}
BENCHMARK(PoolOfTheCavity)->Unit(benchmark::kMillisecond);

void SmokeOfTheCavity(benchmark::State& bench) {
  const auto model = vest::smoke::buildModel({});
  auto state = vest::smoke::initialState(model);
  vest::smoke::Scratch scratch(model);
  vest::smoke::Inputs in;
  in.source_count = 1;
  in.sources[0] = {{0, 0.05, 0.05}, 0.6};
  for (auto _ : bench) vest::smoke::step(model, in, state, scratch);
}
BENCHMARK(SmokeOfTheCavity)->Unit(benchmark::kMillisecond);

}  // namespace

BENCHMARK_MAIN();
