// Real-time factor of a binary tree of about 2,200 cells on one thread (floor 4, aim 20), and the cost of a
// cell.

#include <benchmark/benchmark.h>

#include <stdexcept>

#include "tree.h"
#include "vest_effects/haemodynamics/kernel_level.h"

namespace {

using namespace vest::haemodynamics;

void tree2200(benchmark::State& run) {
  const Model model = bench::tree2200();
  State state = initialState(model);
  Scratch scratch(model, static_cast<int>(run.range(0)));
  const Inputs inputs;
  for (int i = 0; i < 100; ++i) step(model, inputs, 1e-3, state, scratch);
  long substeps = 0, steps = 0;
  for (auto _ : run) {
    const StepReport report = step(model, inputs, 1e-3, state, scratch);
    if (report.status != Status::kOk) throw std::runtime_error(toText(report.status));
    substeps += report.substeps;
    ++steps;
  }
  run.counters["cells"] = model.cells;
  run.counters["substeps_per_ms"] = static_cast<double>(substeps) / static_cast<double>(steps);
  run.counters["real_time_factor"] =
      benchmark::Counter(1e-3 * static_cast<double>(steps), benchmark::Counter::kIsRate);
  run.counters["cell_steps"] =
      benchmark::Counter(static_cast<double>(substeps) * model.cells, benchmark::Counter::kIsRate);
  run.SetLabel(kernelLevel());
}
BENCHMARK(tree2200)->Arg(1)->Arg(2)->UseRealTime()->Unit(benchmark::kMicrosecond);

}  // namespace

BENCHMARK_MAIN();
