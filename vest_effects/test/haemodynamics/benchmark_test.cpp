// Networks of the benchmark literature that the package ships: the aortic bifurcation against published
// values, and 37 branches of silicone with purely resistive ends.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <sstream>

#include "vest_effects/haemodynamics/pulse_run.h"

using namespace vest::haemodynamics;

namespace {

PulseResult run(const std::string& name, double dx, int cycles, Model& model) {
  model = buildModel(readCase(name.front() == '/' ? name : VEST_TEST_DATA "/" + name), dx);
  PulseOptions options;
  options.cycles = cycles;
  return runPulse(model, options);
}

std::vector<std::string> fields(const std::string& line) {
  std::vector<std::string> out;
  std::stringstream in(line);
  for (std::string f; std::getline(in, f, ',');) out.push_back(f);
  return out;
}

}  // namespace

TEST(Benchmark, AorticBifurcationReproducesThePublishedCurveInTheIliacArtery) {
  Model model;
  const PulseResult result = run("aortic_bifurcation", 0.002, 0, model);
  ASSERT_EQ(result.status, Status::kOk);
  EXPECT_TRUE(result.periodic);
  EXPECT_LT(result.mass_error, 1e-9);
  std::ifstream in(VEST_TEST_DATA "/aortic_bifurcation/reference.csv");
  std::string line;
  std::getline(in, line);
  double p_square = 0, q_square = 0, p_most = 0;
  int points = 0;
  double q_range = 0;
  for (const auto& row : result.samples) q_range = std::max(q_range, row[1].middle.flow);
  for (; std::getline(in, line); ++points) {
    const auto f = fields(line);
    ASSERT_EQ(f.size(), 4U);
    ASSERT_EQ(f[0], model.segments[1].name);
    double t, p, q;
    ASSERT_TRUE(parseNumber(f[1], t) && parseNumber(f[2], p) && parseNumber(f[3], q));
    const Sample& now = result.samples[static_cast<std::size_t>(t * 1000 + 0.5)][1].middle;
    p_square += (now.pressure - p) * (now.pressure - p);
    q_square += (now.flow - q) * (now.flow - q);
    p_most = std::max(p_most, p);
  }
  ASSERT_EQ(points, 16);
  const double p_error = std::sqrt(p_square / points) / p_most,
               q_error = std::sqrt(q_square / points) / q_range;
  std::printf("iliac artery: RMS of P %.3f %%, of Q %.3f %%\n", 100 * p_error, 100 * q_error);
  EXPECT_LT(p_error, 0.002);  // the inflow is known at 100 points only
  EXPECT_LT(q_error, 0.005);
}

TEST(Benchmark, BothIliacArteriesAreTheSame) {
  Model model;
  const PulseResult result = run("aortic_bifurcation", 0.005, 2, model);
  ASSERT_EQ(result.status, Status::kOk);
  for (const auto& row : result.samples) {
    EXPECT_EQ(row[1].middle.pressure, row[2].middle.pressure);
    EXPECT_EQ(row[1].distal.flow, row[2].distal.flow);
  }
}

namespace {

/// Mass is kept, and halved cells leave at most `share` of the pressure's difference from the finest grid.
void expectBalanceAndConvergence(const std::string& name, std::size_t segments, int cycles, double share) {
  std::vector<PulseResult> results;
  Model model;
  for (const double dx : {0.016, 0.008, 0.004}) results.push_back(run(name, dx, cycles, model));
  EXPECT_EQ(model.segments.size(), segments);
  for (const auto& r : results) {
    ASSERT_EQ(r.status, Status::kOk);
    EXPECT_LT(r.mass_error, 1e-9);
  }
  const auto distance = [&](const PulseResult& a, const PulseResult& b) {
    double worst = 0;
    for (std::size_t k = 0; k < model.segments.size(); ++k) {
      double square = 0, most = 0;
      for (std::size_t i = 0; i < a.samples.size(); ++i) {
        const double d = a.samples[i][k].middle.pressure - b.samples[i][k].middle.pressure;
        square += d * d;
        most = std::max(most, b.samples[i][k].middle.pressure);
      }
      worst = std::max(worst, std::sqrt(square / static_cast<double>(a.samples.size())) / most);
    }
    return worst;
  };
  const double coarse = distance(results[0], results[2]), fine = distance(results[1], results[2]);
  std::printf("%zu segments: worst RMS of P, 16 mm %.3f %%, 8 mm %.3f %% from 4 mm\n", segments, 100 * coarse,
              100 * fine);
  EXPECT_LT(fine, share * coarse);
  EXPECT_LT(fine, 0.002);
}

}  // namespace

TEST(Benchmark, ThirtySevenBranchesWithPureResistancesConserveMassAndConverge) {
  expectBalanceAndConvergence("silicone_37", 37, 5, 0.5);
}

TEST(Benchmark, TheSeventySevenSegmentsOfARealTreeConserveMassAndConvergeWhereTheyLieAtHand) {
  const char* elsewhere = std::getenv("VEST_SHARED_DATA");
  const std::string folder = std::string(elsewhere ? elsewhere : VEST_SHARED_DATA) + "/adan56";
  if (std::ifstream(folder + "/case.json")) expectBalanceAndConvergence(folder, 77, 1, 0.75);
}
