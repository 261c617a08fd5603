// vest_pulse: pulse waves in a network of arteries, from a case folder to curves (files: README.md of
// vest_effects).

#include <CLI/CLI.hpp>
#include <chrono>
#include <cstdio>
#include <exception>
#include <string>

#include "vest_effects/haemodynamics/kernel_level.h"
#include "vest_effects/haemodynamics/pulse_run.h"
#include "vest_instruments/files/read.h"

namespace {

using namespace vest::haemodynamics;

int run(const std::string& folder, const std::string& output, double dx, const PulseOptions& options) {
  const auto start = std::chrono::steady_clock::now();
  const Model model = buildModel(readCase(folder), dx);
  const PulseResult result = runPulse(model, options);
  const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - start;
  if (result.status != Status::kOk) {
    std::fprintf(stderr, "vest_pulse: %s: %s%s%s at t = %s s\n", vest::files::shown(folder, 6000).c_str(),
                 toText(result.status), result.failed_segment >= 0 ? ", segment " : "",
                 result.failed_segment >= 0 ? model.segments[result.failed_segment].name.c_str() : "",
                 formatNumber(result.failed_time).c_str());
    return 1;
  }
  writePulse(model, result, output);
  // formatNumber keeps the point in any locale.
  const auto text = [](double value) { return formatNumber(value); };
  std::printf("run time: %s s for %d cycles of %s s (%s times real time, %d thread(s), kernel %s)\n",
              text(elapsed.count()).c_str(), result.cycles, text(model.period).c_str(),
              text(result.cycles * model.period / elapsed.count()).c_str(), options.threads, kernelLevel());
  std::printf("cells: %d in %zu segments, %ld sub-steps\n", model.cells, model.segments.size(),
              result.substeps);
  std::printf("mass balance: relative error %s (last cycle: inflow %s m3, outflow %s m3, stored %s m3)\n",
              text(result.mass_error).c_str(), text(result.inflow_volume).c_str(),
              text(result.outflow_volume).c_str(), text(result.stored_volume).c_str());
  std::printf("change from the cycle before: %s\n", text(result.change).c_str());
  if (options.cycles == 0 && !result.periodic)
    std::fprintf(stderr,
                 "vest_pulse: warning: not periodic after %d cycles; --cycles N runs as many as wanted\n",
                 result.cycles);
  return 0;
}

// CLI11's own conversion follows the locale.
double length(const std::string& text) {
  double value = 0;
  if (!parseNumber(text, value) || !(value > 0))
    throw CLI::ValidationError("--dx", text + ": allowed is a length > 0 in metres");
  return value;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{
      "Pulse waves in a network of elastic arteries: reads case.json, network.csv, inflow.csv; writes "
      "pressure, "
      "flow and area of the last cycle."};
  std::string folder, output, dx = "0.002";
  PulseOptions options;
  app.add_option("CASE_DIR", folder, "folder with case.json, network.csv, inflow.csv")->required();
  app.add_option("--cycles", options.cycles,
                 "inflow periods to run (default: until periodic, 1e-4, at most 200)")
      ->check(CLI::Range(1, 1000000));
  app.add_option("--dx", dx, "greatest cell size in metres")->capture_default_str();
  app.add_option("--threads", options.threads, "threads")->check(CLI::Range(1, 256))->capture_default_str();
  app.add_option("--output", output, "folder for the curves")->required();
  CLI11_PARSE(app, argc, argv);
  try {
    return run(folder, output, length(dx), options);
  } catch (const CLI::Error& error) {
    return app.exit(error);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "vest_pulse: %s\n", vest::files::shown(error.what(), 6000).c_str());
    return 1;
  }
}
