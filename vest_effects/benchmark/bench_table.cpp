// The table of speed: every row of what "fast" means for blood, water and smoke, with its floor and aim.
// rosrun vest_effects vest_effects_bench_table [--output docs/benchmarks_effects.md]
#include <time.h>

#include <algorithm>
#include <cstdio>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "tree.h"
#include "vest_effects/haemodynamics/kernel_level.h"
#include "vest_effects/smoke/smoke.h"
#include "waters.h"

namespace {

using namespace vest;

/// Particle-steps a second of the PositionBasedDynamics library on one thread of the machine that the targets
/// were set on; not measured again here.
constexpr double kPbdParticleSteps = 0.15e6;

/// s of CPU time of this thread: what else the machine does is not counted.
double cpuNow() {
  timespec t;
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

template <class... Values>
std::string text(const char* format, Values... values) {
  char line[256];
  std::snprintf(line, sizeof line, format, values...);
  return line;
}

class Table {
 public:
  /// The greater the better.
  void ratio(const std::string& what, const std::string& how, double value, double floor, double aim) {
    const bool held = value >= floor;
    holds_ &= held;
    rows_ << "| " << what << " | **" << text("%.1f×", value) << "** (" << how << ") | "
          << text("%.3g×", floor) << " | " << text("%.3g×", aim) << " | "
          << (held ? "floor held" : "**below the floor**") << " |\n";
  }
  /// What a step costs, with no floor of its own.
  void cost(const std::string& what, double seconds) {
    rows_ << "| " << what << " | " << text("%.0f µs", 1e6 * seconds) << " | | | |\n";
  }
  std::string markdown() const {
    return "| | measured | floor | aim | |\n| --- | --- | --- | --- | --- |\n" + rows_.str();
  }
  bool holds() const { return holds_; }

 private:
  std::ostringstream rows_;
  bool holds_ = true;
};

/// Median CPU time (s) of a call of f.
template <class F>
double timeOf(int calls, F&& f) {
  std::vector<double> times;
  for (int k = 0; k < calls; ++k) {
    const double begin = cpuNow();
    f();
    times.push_back(cpuNow() - begin);
  }
  return median(times);
}

void pulse(Table& table) {
  namespace hd = haemodynamics;
  const hd::Model model = hd::bench::tree2200();
  hd::State state = hd::initialState(model);
  hd::Scratch scratch(model, 1);
  // A second is a beat: whole beats, for the time step follows the pressure.
  const double beat = timeOf(5, [&] {
    for (int ms = 0; ms < 1000; ++ms) {
      const hd::StepReport report = hd::step(model, hd::Inputs{}, 1e-3, state, scratch);
      if (report.status != hd::Status::kOk) throw std::runtime_error(hd::toText(report.status));
    }
  });
  table.ratio(text("pulse waves in a tree of %d cells, 63 vessels, against real time", model.cells),
              text("%.1f ms a beat of 1 s", 1e3 * beat), 1.0 / beat, 4, 20);
}

/// Particle-steps a second while f makes `steps` steps; `f` begins anew each time.
template <class Make>
void particles(Table& table, const std::string& what, int steps, Make&& make) {
  std::vector<double> rates, counts;
  for (int round = 0; round < 5; ++round) {
    fluid::specimen::Fluid f = make();
    double done = 0;
    const double begin = cpuNow();
    for (int k = 0; k < steps; ++k) {
      f.step();
      done += static_cast<double>(f.state.particles.count);
    }
    rates.push_back(done / (cpuNow() - begin));
    counts.push_back(done / steps);
  }
  const double rate = median(rates);
  table.ratio(
      what + ", against the PositionBasedDynamics library",
      text("%.2f M particle-steps/s of %.0f particles; the library: 0.15 M", 1e-6 * rate, median(counts)),
      rate / kPbdParticleSteps, 3, 10);
}

void pools(Table& table) {
  fluid::specimen::Fluid f = fluid::bench::poolOfTheCavity();
  table.cost("pools over a third of the cavity, a step of 4 ms",
             timeOf(201, [&] { fluid::stepPools(f.model, 9.81, 0.004, f.state, f.scratch); }));
}

void smokes(Table& table) {
  const auto model = smoke::buildModel({});
  auto state = smoke::initialState(model);
  smoke::Scratch scratch(model);
  smoke::Inputs in;
  in.source_count = 1;
  in.sources[0] = {{0, 0.05, 0.05}, 0.6};
  table.cost("smoke of the cavity, a step of 20 ms",
             timeOf(201, [&] { smoke::step(model, in, state, scratch); }));
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"Prints the table of speed of blood, water and smoke: floors and aims"};
  std::string output;
  bool strict = false;
  app.add_option("--output", output, "markdown page to write");
  app.add_flag("--strict", strict, "exit 1 where a floor is not held");
  CLI11_PARSE(app, argc, argv);
  Table table;
  pulse(table);
  particles(table, "particles, a dense block that breaks, 3 iterations", 60,
            [] { return fluid::bench::denseBlock(3); });
  particles(table, "particles, irrigation of 3 l/min on a plate", 400,
            [] { return fluid::bench::irrigation(); });
  pools(table);
  smokes(table);
  const std::string rows = table.markdown();
  std::printf("kernel level %s\n%s", fluid::kernelLevel(), rows.c_str());
  if (!output.empty()) {
    std::ofstream page(output);
    page << "# How fast blood, water and smoke are\n\nMade by `rosrun vest_effects vest_effects_bench_table "
            "--output docs/benchmarks_effects.md`; do not edit. One thread (kernel level "
         << fluid::kernelLevel()
         << "), medians of CPU time:\nabsolute times move from machine to machine. The rate of the "
            "PositionBasedDynamics library is the one that the targets were set by,\non a like machine; it "
            "is not measured again. How fast tissue is: [benchmarks.md](benchmarks.md).\n\n"
         << rows;
    if (!page) {
      std::fprintf(stderr, "vest_effects_bench_table: cannot write %s\n", output.c_str());
      return 1;
    }
  }
  return strict && !table.holds() ? 1 : 0;
}
