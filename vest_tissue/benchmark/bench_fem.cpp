// FFEM at 2,460 surface unknowns: a contact answer from 30 loaded unknowns, held unknowns, a cut of rank 36
// until its answer is usable, and the contact answer behind it. rosrun vest_tissue vest_bench_fem
#include <benchmark/benchmark.h>

#include "slab_under_load.h"

namespace {

vest::bench::SlabUnderLoad& slab() {
  static vest::bench::SlabUnderLoad s;  // its precomputation takes seconds
  return s;
}

void contactAnswer(benchmark::State& state) {
  slab().makeWhole();
  for (auto _ : state) slab().answer();
  state.counters["unknowns"] = static_cast<double>(slab().model().surfaceUnknowns());
}

void prescribedDisplacement(benchmark::State& state) {
  slab().makeWhole();
  for (auto _ : state) slab().prescribe();
}

void cutUntilUsable(benchmark::State& state) {
  int rank = 0;
  for (auto _ : state) {
    state.PauseTiming();
    slab().makeWhole();
    state.ResumeTiming();
    rank = slab().cut();
  }
  state.counters["rank"] = rank;
}

void contactAnswerAfterTheCut(benchmark::State& state) {
  slab().makeWhole();
  slab().cut();
  for (auto _ : state) slab().answer();
}

}  // namespace

BENCHMARK(contactAnswer)->Unit(benchmark::kMicrosecond);
BENCHMARK(prescribedDisplacement)->Unit(benchmark::kMicrosecond);
BENCHMARK(cutUntilUsable)->Unit(benchmark::kMillisecond);
BENCHMARK(contactAnswerAfterTheCut)->Unit(benchmark::kMicrosecond);
BENCHMARK_MAIN();
