// Particle-steps a second on one thread (the PositionBasedDynamics library does 0.15 M; floor 3 times, aim
// 10), and what pools, smoke and lens cost.

#include <benchmark/benchmark.h>

#include "vest_effects/smoke/smoke.h"
#include "waters.h"

namespace {

using namespace vest::fluid;

void report(benchmark::State& run, double steps) {
  run.counters["Mparticle_steps/s"] = benchmark::Counter(1e-6 * steps, benchmark::Counter::kIsRate);
  run.counters["times_PBD_0.15M/s"] = benchmark::Counter(steps / 0.15e6, benchmark::Counter::kIsRate);
}

void Irrigation(benchmark::State& run) {
  specimen::Fluid f = bench::irrigation();
  double steps = 0;
  for (auto _ : run) {
    f.step();
    steps += static_cast<double>(f.state.particles.count);
  }
  run.counters["particles"] = static_cast<double>(f.state.particles.count);
  report(run, steps);
}
BENCHMARK(Irrigation)
    ->Iterations(400)
    ->Unit(benchmark::kMillisecond);  // the film grows: the same span each time

void DenseBlock(benchmark::State& run) {
  specimen::Fluid f = bench::denseBlock(static_cast<int>(run.range(0)));
  double steps = 0;
  for (auto _ : run) {
    f.step();
    steps += static_cast<double>(f.state.particles.count);
  }
  run.counters["particles"] = static_cast<double>(f.state.particles.count);
  report(run, steps);
}
BENCHMARK(DenseBlock)->Arg(3)->Arg(5)->Unit(benchmark::kMillisecond);

void PoolOfTheCavity(benchmark::State& run) {
  specimen::Fluid f = bench::poolOfTheCavity();
  for (auto _ : run) stepPools(f.model, 9.81, 0.004, f.state, f.scratch);
}
BENCHMARK(PoolOfTheCavity)->Unit(benchmark::kMillisecond);

void SmokeOfTheCavity(benchmark::State& run) {
  const auto model = vest::smoke::buildModel({});
  auto state = vest::smoke::initialState(model);
  vest::smoke::Scratch scratch(model);
  vest::smoke::Inputs in;
  in.source_count = 1;
  in.sources[0] = {{0, 0.05, 0.05}, 0.6};
  for (auto _ : run) vest::smoke::step(model, in, state, scratch);
}
BENCHMARK(SmokeOfTheCavity)->Unit(benchmark::kMillisecond);

}  // namespace

BENCHMARK_MAIN();
