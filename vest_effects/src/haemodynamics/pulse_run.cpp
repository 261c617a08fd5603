#include "vest_effects/haemodynamics/pulse_run.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <stdexcept>

#include "vest_instruments/files/replace.h"

namespace vest::haemodynamics {

namespace {

// Greatest change of pressure or flow at a segment's middle, relative to the greatest of that segment. The
// flow of a segment that carries next to nothing is measured against a thousandth of the greatest flow
// anywhere, or noise would decide.
double changeBetween(const std::vector<std::vector<SegmentSample>>& before,
                     const std::vector<std::vector<SegmentSample>>& now) {
  const std::size_t segments = now.front().size();
  double greatest_flow = 0;
  for (const auto& row : now)
    for (const auto& s : row) greatest_flow = std::max(greatest_flow, std::fabs(s.middle.flow));
  double change = 0;
  for (std::size_t k = 0; k < segments; ++k) {
    double p = 0, q = 1e-3 * greatest_flow, dp = 0, dq = 0;
    for (std::size_t i = 0; i < now.size(); ++i) {
      const Sample &a = before[i][k].middle, &b = now[i][k].middle;
      p = std::max(p, std::fabs(b.pressure));
      q = std::max(q, std::fabs(b.flow));
      dp = std::max(dp, std::fabs(b.pressure - a.pressure));
      dq = std::max(dq, std::fabs(b.flow - a.flow));
    }
    if (p > 0) change = std::max(change, dp / p);
    if (q > 0) change = std::max(change, dq / q);
  }
  return change;
}

struct Account {
  double in = 0, out = 0, stored = 0;
};

Account account(const Model& model, const State& state) {
  Account a;
  for (std::size_t n = 0; n < model.nodes.size(); ++n) {
    if (model.nodes[n].kind == NodeKind::kInflow) a.in += state.node_volume[n];
    if (model.nodes[n].kind == NodeKind::kTerminal) a.out -= state.node_volume[n];
  }
  a.stored = volume(model, state);
  return a;
}

void writeFile(const std::filesystem::path& path, const std::string& text) {
  std::ofstream stream = files::replacing(path.string());
  stream << text;
  stream.close();
  if (!stream) throw std::runtime_error(path.string() + ": cannot be written");
}

}  // namespace

PulseResult runPulse(const Model& model, const PulseOptions& options) {
  PulseResult result;
  State state = initialState(model);
  Scratch scratch(model, options.threads);
  const Inputs inputs;
  const int count = std::max(1, static_cast<int>(std::ceil(model.period / options.sample_period - 1e-6)));
  std::vector<std::vector<SegmentSample>> before;
  result.samples.assign(count, std::vector<SegmentSample>(model.segments.size()));
  for (int i = 0; i < count; ++i) result.time.push_back(i * options.sample_period);

  const int limit = options.cycles > 0 ? options.cycles : options.most_cycles;
  for (int cycle = 0; cycle < limit; ++cycle) {
    const Account start = account(model, state);
    state.phase = 0;  // drops the rounding that a cycle's steps leave
    for (int i = 0; i < count; ++i) {
      bool solved = sample(model, inputs, state, scratch, result.samples[i]);
      const double next = i + 1 < count ? result.time[i + 1] : model.period;
      const StepReport report = step(model, inputs, next - result.time[i], state, scratch);
      result.substeps += report.substeps;
      if (!solved || report.status != Status::kOk) {
        result.status = report.status != Status::kOk ? report.status : Status::kNotConverged;
        result.failed_segment = report.segment;
        result.failed_time = state.time;
        return result;
      }
    }
    result.cycles = cycle + 1;
    const Account end = account(model, state);
    result.inflow_volume = end.in - start.in;
    result.outflow_volume = end.out - start.out;
    result.stored_volume = end.stored - start.stored;
    result.change = before.empty() ? 1 : changeBetween(before, result.samples);
    // A slow windkessel changes little a cycle and still takes up blood: inflow and outflow must agree, too.
    const double moved = std::max(std::fabs(result.inflow_volume), 1e-3 * end.stored);
    result.periodic = result.change < options.tolerance &&
                      std::fabs(result.inflow_volume - result.outflow_volume) < 2 * options.tolerance * moved;
    if (options.cycles == 0 && result.periodic) break;
    before = result.samples;
  }
  const double scale = std::max({std::fabs(result.inflow_volume), std::fabs(result.outflow_volume), 1e-30});
  result.mass_error = std::fabs(result.inflow_volume - result.outflow_volume - result.stored_volume) / scale;
  return result;
}

void writePulse(const Model& model, const PulseResult& result, const std::string& folder) {
  const std::filesystem::path path(folder);
  std::error_code error;
  std::filesystem::create_directories(path, error);
  if (!std::filesystem::is_directory(path)) throw std::runtime_error(folder + ": cannot be made a folder");
  std::string summary = "id,name,P_mean_Pa,P_min_Pa,P_max_Pa,Q_mean_m3_s,Q_min_m3_s,Q_max_m3_s\n";
  const struct {
    const char* suffix;
    Sample SegmentSample::*site;
  } sites[] = {{"_prox.csv", &SegmentSample::proximal},
               {"_mid.csv", &SegmentSample::middle},
               {"_dist.csv", &SegmentSample::distal}};
  for (std::size_t k = 0; k < model.segments.size(); ++k) {
    const SegmentModel& segment = model.segments[k];
    for (const auto& site : sites) {
      std::string text = "t_s,P_Pa,Q_m3_s,A_m2\n";
      for (std::size_t i = 0; i < result.time.size(); ++i) {
        const Sample& s = result.samples[i][k].*site.site;
        text += formatNumber(result.time[i]) + ',' + formatNumber(s.pressure) + ',' + formatNumber(s.flow) +
                ',' + formatNumber(s.area) + '\n';
      }
      writeFile(path / (segment.name + site.suffix), text);
    }
    double p_sum = 0, q_sum = 0, p_min = 1e300, p_max = -1e300, q_min = 1e300, q_max = -1e300;
    for (const auto& row : result.samples) {
      const Sample& s = row[k].middle;
      p_sum += s.pressure;
      q_sum += s.flow;
      p_min = std::min(p_min, s.pressure);
      p_max = std::max(p_max, s.pressure);
      q_min = std::min(q_min, s.flow);
      q_max = std::max(q_max, s.flow);
    }
    const double n = static_cast<double>(result.samples.size());
    summary += segment.id + ',' + segment.name;
    for (double value : {p_sum / n, p_min, p_max, q_sum / n, q_min, q_max})
      summary += ',' + formatNumber(value);
    summary += '\n';
  }
  writeFile(path / "summary.csv", summary);
}

}  // namespace vest::haemodynamics
