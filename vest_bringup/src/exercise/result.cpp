#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "engine_state.h"

namespace vest::exercise {
namespace {

constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

/// In the unit of the metric.
double figureOf(Metric metric, const std::string& tool, const session::motion::Figures& figures) {
  const auto scaled = [](const std::optional<double>& value, double by) {
    return value ? by * *value : kUnknown;
  };
  if (metric == Metric::Bimanual) return scaled(figures.bimanual, 100);
  if (metric == Metric::PathRatio) return scaled(figures.path_ratio, 100);
  for (const session::motion::ToolFigures& f : figures.tools) {
    if (f.name != tool) continue;
    switch (metric) {
      case Metric::FilteredPath:
        return scaled(f.filtered_path, 1e3);
      case Metric::AngularPath:
        return scaled(f.angular_path, 1 / kDegree);
      case Metric::DepthPath:
        return scaled(f.depth_path, 1e3);
      case Metric::DepthTurns:
        return scaled(f.depth_turns, 1);
      case Metric::Economy:
        return scaled(f.economy, 100);
      case Metric::MeanSpeed:
        return 1e3 * f.mean_speed;
      case Metric::PeakSpeed:
        return scaled(f.filtered_peak_speed, 1e3);
      case Metric::Rest:
        return scaled(f.filtered_idle_fraction, 100);
      case Metric::RmsJerk:
        return scaled(f.filtered_rms_jerk, 1);
      case Metric::Sparc:
        return scaled(f.sparc, 1);
      case Metric::Ldlj:
        return scaled(f.ldlj, 1);
      default:
        return kUnknown;
    }
  }
  return kUnknown;
}

/// Figures of motion when the exercise is over, each part of it once.
class AtTheEnd {
 public:
  AtTheEnd(const Engine::Model& model, const Engine::State& state) : m_(model), s_(state) {}

  /// @param phase its part alone; beyond the last: since the first phase began
  /// @return NaN where it is not known
  double figure(std::size_t number, std::size_t phase) {
    if (s_.clock.finished == 0) return kUnknown;
    const bool part = phase < m_.phases.size();
    if (part && s_.phases[phase].begun == 0) return kUnknown;
    if (known_.count(phase) == 0) {
      const std::uint64_t from = part ? s_.phases[phase].begun : s_.clock.begun;
      const std::uint64_t to =
          part && s_.phases[phase].ended != 0 ? s_.phases[phase].ended : s_.clock.finished;
      known_[phase] = s_.log.figures(s_.moments, static_cast<double>(from), static_cast<double>(to));
    }
    const BuiltNumber& n = m_.numbers[number];
    return figureOf(n.metric, std::string(tools::instrumentName(static_cast<tools::Instrument>(n.tool))),
                    known_[phase]);
  }

  /// What a gate needs, with the figures in it.
  bool holds(const Range& gate) {
    using Kind = Condition::Kind;
    std::map<std::size_t, bool> value;
    for (std::size_t i = gate.begin; i < gate.end; ++i) {
      const Node& n = m_.nodes[i];
      std::size_t held = 0;
      for (const std::size_t child : n.children) held += value[child];
      value[i] = s_.nodes[i].value != 0;
      if (n.kind == Kind::Any) value[i] = held > 0;
      if (n.kind == Kind::All) value[i] = held == n.children.size();
      if (n.kind == Kind::Not) value[i] = held == 0;
      if (n.kind != Kind::Number || (infoOf(m_.numbers[n.number].metric).needs & kFigure) == 0) continue;
      const double is = figure(n.number, m_.phases.size());
      value[i] = is >= n.low && is <= n.high;
    }
    return value[gate.end - 1];
  }

 private:
  const Engine::Model& m_;
  const Engine::State& s_;
  std::map<std::size_t, session::motion::Figures> known_;  ///< by phase
};

}  // namespace

Result resultOf(const Engine::Model& m, const Engine::State& s) {
  const Exercise& e = m.exercise;
  AtTheEnd end(m, s);
  Result r;
  r.exercise = e.name, r.hash = e.hash;
  r.time = sinceBegin(s.clock);
  r.finished = s.clock.finished != 0;
  r.flags = s.clock.flags;
  r.input_hash = s.clock.input_hash;
  r.moments = s.moments;
  bool missing = false;
  for (std::size_t i = 0; i < e.phases.size(); ++i) {
    if (!e.phases[i].required || s.phases[i].ended != 0) continue;
    missing = true;
    r.failed_by.push_back(e.phases[i].name);
  }
  for (std::size_t i = 0; i < e.gates.size(); ++i)
    if (e.gates[i].never ? s.gates[i] != 0 : !end.holds(m.gates[i])) r.failed_by.push_back(e.gates[i].name);
  for (const ToolState& t : s.tools) {
    if (t.wrong == 0) continue;
    r.failed_by.emplace_back("tools");
    break;
  }
  if (s.clock.wrong_optic != 0) r.failed_by.emplace_back("optic");
  r.errors = s.errors;
  for (std::size_t i = 0; i < e.errors.size(); ++i)
    r.error_points += e.errors[i].points * static_cast<double>(s.errors[i]);
  double weights = 0;
  for (std::size_t i = 0; i < e.items.size(); ++i) {
    const Item& item = e.items[i];
    Result::ItemScore score;
    const bool figure = (infoOf(item.number.metric).needs & kFigure) != 0;
    score.value = figure ? end.figure(m.items[i], m.phase_of_item[i]) : s.results[i];
    // 100 where it is proficient, 50 where it just passes, linear through both. What is not known is worth
    // nothing: who holds still gets no points for smoothness.
    const double part = (score.value - item.pass) / (item.proficient - item.pass);
    score.points = missing || std::isnan(part) ? 0.0 : std::clamp(50.0 + 50.0 * part, 0.0, 100.0);
    score.passed = part >= 0;
    if (!score.passed) r.failed_by.push_back(item.name);
    r.quality += item.weight * score.points;
    weights += item.weight;
    r.items.push_back(score);
  }
  r.quality = weights > 0 ? r.quality / weights : 0.0;
  const double raw = std::max(0.0, e.limit - r.time - r.error_points);
  if (!missing) r.total = std::min(100.0, 100.0 * raw / (e.limit - e.proficient));
  if (!missing && r.time < e.least) r.flags |= kImplausible;
  r.passed = r.finished && r.failed_by.empty() && (r.flags & (kImplausible | kFault)) == 0;
  return r;
}

}  // namespace vest::exercise
