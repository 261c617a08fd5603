// µs per step of a net of the seed scene's size, of the kernel and of Bullet's soft body on the same net.
// rosrun vest_tissue vest_bench_net; ratios: vest_bench_table
#include <benchmark/benchmark.h>

#include "nets_in_kernel.h"

namespace {

using namespace vest::bench;
using namespace vest::net;

void kernelStep(benchmark::State& state, bool shuffled, KernelLevel level) {
  Net net(shuffled);
  for (auto _ : state) net.step(level);
  state.counters["links/s"] =
      benchmark::Counter(static_cast<double>(net.links()) * state.iterations(), benchmark::Counter::kIsRate);
}

#if defined(VEST_HAVE_BULLET)
void bulletStep(benchmark::State& state) {
  BulletNet net;
  for (auto _ : state) net.step();
}
#endif

}  // namespace

BENCHMARK_CAPTURE(kernelStep, runs_baseline, false, KernelLevel::Baseline)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(kernelStep, runs_best, false, chooseKernelLevel())->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(kernelStep, any_best, true, chooseKernelLevel())->Unit(benchmark::kMicrosecond);
#if defined(VEST_HAVE_BULLET)
BENCHMARK(bulletStep)->Unit(benchmark::kMicrosecond);
#endif

BENCHMARK_MAIN();
