// Real-time factor of a binary tree of about 2,200 cells on one thread (floor 4, aim 20), and the cost of a
// cell.

#include <benchmark/benchmark.h>

#include <cmath>
#include <stdexcept>
#include <string>

#include "vest_effects/haemodynamics/kernel_level.h"
#include "vest_effects/haemodynamics/step.h"

namespace {

using namespace vest::haemodynamics;

/// Six generations, 63 segments, radii by Murray's law, about 12 cm each at first and shorter towards the
/// ends.
Network tree() {
  Network n;
  n.viscosity = 0.004;
  const int generations = 6;
  double radius = 0.012, length = 0.16;
  long next = 2;
  std::vector<long> ends{1};
  for (int g = 0; g < generations; ++g) {
    std::vector<long> fresh;
    for (long from : ends) {
      for (int branch = 0; branch < (g == 0 ? 1 : 2); ++branch) {
        SegmentSpec s;
        s.id = std::to_string(n.segments.size() + 1);
        s.name = "segment_" + s.id;
        s.node_in = from;
        s.node_out = next++;
        s.length = length * (1 + 0.1 * branch);
        s.radius_proximal = radius;
        s.radius_distal = 0.9 * radius;
        s.wall_proximal = 0.1 * s.radius_proximal;
        s.wall_distal = 0.1 * s.radius_distal;
        s.youngs_modulus = 4e5;
        s.reference_pressure = 10000;
        if (g == generations - 1) {
          s.terminal = true;
          s.load = {1e9, 3e9, 3e-11, 0};
        }
        fresh.push_back(s.node_out);
        n.segments.push_back(s);
      }
    }
    ends = fresh;
    radius *= 0.9 * std::pow(0.5, 1.0 / 3);
    length *= 0.9;
  }
  for (int i = 0; i <= 100; ++i) {
    const double t = 0.01 * i;
    n.inflow.push_back({t, t < 0.35 ? 4e-4 * std::pow(std::sin(3.14159265358979 * t / 0.35), 2) : 0, i + 2});
  }
  return n;
}

void tree2200(benchmark::State& bench) {
  const Network network = tree();
  double total = 0;
  for (const auto& s : network.segments) total += s.length;
  const Model model =
      buildModel(network, total / (2200 - 0.5 * static_cast<double>(network.segments.size())));
  State state = initialState(model);
  Scratch scratch(model, static_cast<int>(bench.range(0)));
  const Inputs inputs;
  for (int i = 0; i < 100; ++i) step(model, inputs, 1e-3, state, scratch);
  long substeps = 0, steps = 0;
  for (auto _ : bench) {
    const StepReport report = step(model, inputs, 1e-3, state, scratch);
    if (report.status != Status::kOk) throw std::runtime_error(toText(report.status));
    substeps += report.substeps;
    ++steps;
  }
  bench.counters["cells"] = model.cells;
  bench.counters["substeps_per_ms"] = static_cast<double>(substeps) / static_cast<double>(steps);
  bench.counters["real_time_factor"] =
      benchmark::Counter(1e-3 * static_cast<double>(steps), benchmark::Counter::kIsRate);
  bench.counters["cell_steps"] =
      benchmark::Counter(static_cast<double>(substeps) * model.cells, benchmark::Counter::kIsRate);
  bench.SetLabel(kernelLevel());
}
BENCHMARK(tree2200)->Arg(1)->Arg(2)->UseRealTime()->Unit(benchmark::kMicrosecond);

}  // namespace

BENCHMARK_MAIN();
