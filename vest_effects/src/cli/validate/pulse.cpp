#include <algorithm>
#include <cmath>
#include <fstream>
#include <functional>
#include <map>
#include <sstream>
#include <stdexcept>

#include "sections.h"
#include "vest_effects/haemodynamics/pulse_run.h"

namespace vest::validate {
namespace {

using namespace haemodynamics;
using validation::Curve;
using validation::digits;
using validation::Mark;
using validation::Section;

using Columns = std::map<std::string, std::vector<double>>;

Columns readColumns(const std::string& file) {
  std::ifstream in(file);
  std::string line, field;
  if (!std::getline(in, line)) throw std::runtime_error(file + ": cannot be read");
  std::vector<std::string> names;
  for (std::stringstream row(line); std::getline(row, field, ',');) names.push_back(field);
  Columns columns;
  while (std::getline(in, line)) {
    std::stringstream row(line);
    for (std::size_t k = 0; k < names.size() && std::getline(row, field, ','); ++k) {
      double value = 0;
      if (!parseNumber(field, value)) throw std::runtime_error(file + ": " + field + " is no number");
      columns[names[k]].push_back(value);
    }
  }
  return columns;
}

PulseResult run(const std::string& folder, double dx, int cycles, Model& model) {
  model = buildModel(readCase(folder), dx);
  PulseOptions options;
  options.cycles = cycles;
  PulseResult result = runPulse(model, options);
  if (result.status != Status::kOk) throw std::runtime_error(folder + ": " + toText(result.status));
  return result;
}

struct Published {
  const char *name, *title;
  double radius;             ///< m, of the reference
  double p_limit, dp_limit;  ///< %, of the greatest values (case.json)
};

void compare(const Options& options, const Published& one, Section& section) {
  const std::string folder = options.data + "/" + one.name;
  const Columns reference = readColumns(folder + "/ref_fv1d_mid.csv");
  Model model;
  const PulseResult result = run(folder, 0.002, 0, model);
  const std::size_t count = std::min(reference.at("t_s").size(), result.samples.size());
  struct What {
    const char *column, *name, *label;
    double rms, greatest;  ///< %
    std::function<double(const SegmentSample&)> value;
  };
  const std::vector<What> all{
      {"P_kPa", "P", "pressure, kPa", 0.5, one.p_limit,
       [](const SegmentSample& s) { return s.middle.pressure / 1000; }},
      {"Q_ml_s", "Q", "flow, ml/s", 1, 1, [](const SegmentSample& s) { return s.middle.flow * 1e6; }},
      {"dr_mm", "dr", "change of radius, mm", 1, 1,
       [&](const SegmentSample& s) { return 1000 * (std::sqrt(s.middle.area / M_PI) - one.radius); }},
      {"dP_in_minus_out_kPa", "P_in - P_out", "pressure drop, kPa", 1, one.dp_limit,
       [](const SegmentSample& s) { return (s.proximal.pressure - s.distal.pressure) / 1000; }}};
  section.text(std::string("### ") + one.title);
  section.text("Largest cell 2 mm, " + std::to_string(result.cycles) +
               " cycles until periodic; relative mass error of the last cycle " + digits(result.mass_error) +
               ".");
  std::vector<std::vector<std::string>> rows;
  for (const What& what : all) {
    const auto& theirs = reference.at(what.column);
    std::vector<double> ours;
    double sum = 0, greatest = 0;
    for (std::size_t i = 0; i < count; ++i) {
      ours.push_back(what.value(result.samples[i][0]));
      sum += (ours[i] - theirs[i]) * (ours[i] - theirs[i]);
      greatest = std::max(greatest, std::fabs(theirs[i]));
    }
    const auto end = theirs.begin() + static_cast<std::ptrdiff_t>(count);
    const double rms = 100 * std::sqrt(sum / static_cast<double>(count)) / greatest,
                 most =
                     100 *
                     (*std::max_element(ours.begin(), ours.end()) - *std::max_element(theirs.begin(), end)) /
                     greatest,
                 least =
                     100 *
                     (*std::min_element(ours.begin(), ours.end()) - *std::min_element(theirs.begin(), end)) /
                     greatest;
    rows.push_back({what.name, digits(rms), digits(most), digits(least)});
    section.atMost(std::string(one.name) + ", " + what.name + ": RMS error", rms, what.rms,
                   "% of the greatest");
    section.atMost(std::string(one.name) + ", " + what.name + ": error of the greatest value",
                   std::fabs(most), what.greatest, "% of the greatest");
    if (what.name[0] != 'P' && what.name[0] != 'Q') continue;
    if (std::string(what.name).size() > 1) continue;
    validation::Plot plot{std::string(one.title) + ", middle", "time, s", what.label, {}};
    plot.curves.push_back({"here", result.time, ours, Mark::Line});
    Curve dots{"reference, each 25th value", {}, {}, Mark::Points};
    for (std::size_t i = 0; i < count; i += 25)
      dots.x.push_back(reference.at("t_s")[i]), dots.y.push_back(theirs[i]);
    plot.curves.push_back(dots);
    section.plot(std::string(one.name) + "_" + (what.name[0] == 'P' ? "pressure" : "flow"), plot);
  }
  section.table({"curve", "RMS error, %", "greatest value, %", "least value, %"}, rows);
}

/// RMS difference of every middle's pressure and flow from a finer grid's, the worst segment, % of the
/// greatest.
std::pair<double, double> difference(const PulseResult& a, const PulseResult& b) {
  double worst_p = 0, worst_q = 0;
  for (std::size_t s = 0; s < a.samples[0].size(); ++s) {
    double p = 0, q = 0, p_most = 0, q_most = 0;
    for (std::size_t i = 0; i < a.samples.size(); ++i) {
      const Sample &x = a.samples[i][s].middle, &y = b.samples[i][s].middle;
      p += std::pow(x.pressure - y.pressure, 2), q += std::pow(x.flow - y.flow, 2);
      p_most = std::max(p_most, std::fabs(y.pressure)), q_most = std::max(q_most, std::fabs(y.flow));
    }
    const auto n = static_cast<double>(a.samples.size());
    worst_p = std::max(worst_p, 100 * std::sqrt(p / n) / p_most);
    worst_q = std::max(worst_q, 100 * std::sqrt(q / n) / q_most);
  }
  return {worst_p, worst_q};
}

}  // namespace

Section curvesSection(const Options& options, const std::string& command) {
  if (options.data.empty()) throw std::invalid_argument("curves: --data FOLDER is missing");
  Section section("50_pulse_curves", "Pulse waves against published curves", command);
  section.text(
      "Boileau et al. 2015 (Int. J. Numer. Meth. Biomed. Eng. 31(10) e02732), benchmarks 2 and 3, against "
      "the finite-volume "
      "curves at the middle; bounds are those of the cases' own files, relative to the greatest value of the "
      "reference. The "
      "data is not part of this repository: FOLDER holds `cca` and `uta`, each with case.json, network.csv, "
      "inflow.csv and "
      "ref_fv1d_mid.csv.");
  compare(options, {"cca", "Common carotid artery", 0.003, 0.5, 2}, section);
  compare(options, {"uta", "Upper thoracic aorta", 0.012, 0.7, 2}, section);
  return section;
}

Section networksSection(const Options& options, const std::string& command) {
  Section section("51_pulse_networks", "Networks of 3, 37 and 77 segments: grids and mass balance", command);
  section.text(
      "Each network on three grids, the same cycles on each; RMS difference of the middle of the worst "
      "segment from the "
      "finest grid, relative to the greatest value there. Mass balance: |in - out - stored| of the last "
      "cycle, relative to "
      "the inflow. The network of 77 segments is that of Boileau et al. 2015 and only run where its data "
      "lies (`adan56`).");
  struct Case {
    std::string folder, name;
    int cycles;
    std::vector<double> dx;
  };
  std::vector<Case> cases{{options.shipped + "/bifurcation", "bifurcation, 3", 3, {0.008, 0.004, 0.002}},
                          {options.shipped + "/silicone_37", "silicone, 37", 4, {0.016, 0.008, 0.004}}};
  if (!options.data.empty())
    cases.push_back({options.data + "/adan56", "adan56, 77", 3, {0.016, 0.008, 0.004}});
  std::vector<std::vector<std::string>> rows;
  for (const Case& one : cases) {
    std::vector<PulseResult> results;
    std::vector<int> cells;
    Model model;
    double mass = 0;
    for (const double dx : one.dx) {
      results.push_back(run(one.folder, dx, one.cycles, model));
      cells.push_back(model.cells);
      mass = std::max(mass, results.back().mass_error);
    }
    const auto coarse = difference(results[0], results[2]), fine = difference(results[1], results[2]);
    for (int k = 0; k < 2; ++k) {
      const auto& d = k == 0 ? coarse : fine;
      rows.push_back({one.name, digits(1e3 * one.dx[static_cast<std::size_t>(k)]),
                      std::to_string(cells[static_cast<std::size_t>(k)]), digits(d.first), digits(d.second)});
    }
    rows.push_back({one.name, digits(1e3 * one.dx[2]), std::to_string(cells[2]), "reference", "reference"});
    section.atMost(one.name + ": mass balance", 100 * mass, 0.1, "% of the inflow");
    section.atMost(one.name + ": halved cells leave of the pressure's error", fine.first / coarse.first, 0.75,
                   "no unit");
    section.atMost(one.name + ": halved cells leave of the flow's error", fine.second / coarse.second, 0.75,
                   "no unit");
  }
  section.table({"network, segments", "cell, mm", "cells", "P, worst segment, %", "Q, worst segment, %"},
                rows);
  return section;
}

}  // namespace vest::validate
