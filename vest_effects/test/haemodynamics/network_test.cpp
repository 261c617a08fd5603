// Networks: rest, mass, junctions of any shape, short pieces, stiffness.

#include <gtest/gtest.h>

#include "networks.h"
#include "vest_effects/haemodynamics/pulse_run.h"

using namespace vest::haemodynamics;
using namespace vest::haemodynamics::testing;

TEST(Networks, TaperingNetworkAtRestStaysAtRestWhateverItsReferencePressures) {
  for (const bool differing : {false, true}) {
    Network n = mixedNetwork();
    n.inflow = {{0, 0, 2}};
    for (std::size_t i = 0; i < n.segments.size(); ++i) {
      if (differing) n.segments[i].reference_pressure = 8000 + 700.0 * static_cast<double>(i);
      if (n.segments[i].terminal) n.segments[i].load.outflow_pressure = 10000;
    }
    const Model model = buildModel(n, 0.004);
    State state = initialState(model);
    setUniformPressure(model, 10000, state);
    const double before = volume(model, state);
    std::vector<std::vector<SegmentSample>> history;
    ASSERT_EQ(run(model, {}, 1, 0.01, state, &history), Status::kOk);
    double fastest = 0;
    for (double u : state.velocity) fastest = std::max(fastest, std::fabs(u));
    EXPECT_LT(fastest, 1e-11);
    for (const auto& s : history.back()) EXPECT_NEAR(s.middle.pressure, 10000, 1e-7);
    EXPECT_NEAR(volume(model, state), before, 1e-12 * before);
  }
}

TEST(Networks, MassIsKeptAtEveryNodeAndOverTheCycle) {
  const Network n = mixedNetwork();
  const Model model = buildModel(n, 0.004);
  PulseOptions options;
  const PulseResult result = runPulse(model, options);
  ASSERT_EQ(result.status, Status::kOk);
  EXPECT_LT(result.change, 1e-4);
  EXPECT_LT(result.mass_error, 1e-9);
  EXPECT_NEAR(result.outflow_volume, result.inflow_volume, 1e-3 * result.inflow_volume);
  double greatest = 0, worst = 0;
  for (const auto& row : result.samples) {
    greatest = std::max(greatest, std::fabs(row[0].proximal.flow));
    worst = std::max(worst, std::fabs(row[0].distal.flow - row[1].proximal.flow - row[2].proximal.flow));
    worst = std::max(worst, std::fabs(row[1].distal.flow - row[3].proximal.flow - row[4].proximal.flow));
    worst = std::max(worst, std::fabs(row[3].distal.flow + row[4].distal.flow - row[5].proximal.flow));
  }
  EXPECT_LT(worst, 1e-9 * greatest);
  // The flow that was asked for.
  for (std::size_t i = 0; i < result.time.size(); ++i)
    ASSERT_NEAR(result.samples[i][0].proximal.flow, model.inflowAt(result.time[i]), 1e-12);
}

TEST(Networks, TotalPressureIsTheSameForAllSegmentsAtANode) {
  const Network n = mixedNetwork();
  const Model model = buildModel(n, 0.004);
  State state = initialState(model);
  std::vector<std::vector<SegmentSample>> history;
  ASSERT_EQ(run(model, {}, 0.3, 0.01, state, &history), Status::kOk);
  const auto head = [&](const Sample& s) {
    const double u = s.flow / s.area;
    return s.pressure + 0.5 * n.density * u * u;
  };
  for (const auto& row : history) {
    EXPECT_NEAR(head(row[0].distal), head(row[1].proximal), 1e-6 * head(row[0].distal));
    EXPECT_NEAR(head(row[0].distal), head(row[2].proximal), 1e-6 * head(row[0].distal));
    EXPECT_NEAR(head(row[3].distal), head(row[4].distal), 1e-6 * head(row[3].distal));
    EXPECT_NEAR(head(row[3].distal), head(row[5].proximal), 1e-6 * head(row[3].distal));
  }
}

TEST(Networks, ATubeCutIntoShortPiecesBehavesLikeTheWholeTube) {
  const auto build = [](int pieces) {
    Network n = blankNetwork();
    n.viscosity = 0.004;
    for (int i = 0; i < pieces; ++i) {
      const double r0 = 0.006 - 0.002 * i / pieces, r1 = 0.006 - 0.002 * (i + 1) / pieces;
      addSegment(n, i + 1, i + 2, 0.2 / pieces, r0, r1);
    }
    n.segments.back().terminal = true;
    n.segments.back().load = {6e7, 3e8, 2e-9, 0};
    setHump(n, 1e-4, 0.3);
    return n;
  };
  PulseOptions options;
  options.cycles = 5;
  const PulseResult whole = runPulse(buildModel(build(1), 0.002), options);
  for (const int pieces : {4, 40}) {
    const PulseResult cut = runPulse(buildModel(build(pieces), 0.002), options);
    ASSERT_EQ(cut.status, Status::kOk);
    double worst_p = 0, worst_q = 0;
    for (std::size_t i = 0; i < whole.time.size(); ++i) {
      worst_p = std::max(
          worst_p, std::fabs(cut.samples[i][0].proximal.pressure - whole.samples[i][0].proximal.pressure));
      worst_q = std::max(worst_q,
                         std::fabs(cut.samples[i][pieces - 1].distal.flow - whole.samples[i][0].distal.flow));
    }
    EXPECT_LT(worst_p, 0.001 * 15000) << pieces;
    EXPECT_LT(worst_q, 0.001 * 1e-4) << pieces;
  }
}

TEST(Networks, ASegmentDrawnBackwardsCarriesTheSameFlowNegatively) {
  Network n = mixedNetwork();
  const PulseOptions options{2};
  const PulseResult forwards = runPulse(buildModel(n, 0.004), options);
  std::swap(n.segments[4].node_in, n.segments[4].node_out);
  const PulseResult backwards = runPulse(buildModel(n, 0.004), options);
  ASSERT_EQ(backwards.status, Status::kOk);
  for (std::size_t i = 0; i < forwards.time.size(); i += 10) {
    EXPECT_NEAR(backwards.samples[i][4].middle.flow, -forwards.samples[i][4].middle.flow, 1e-12);
    EXPECT_NEAR(backwards.samples[i][4].middle.pressure, forwards.samples[i][4].middle.pressure, 1e-6);
  }
}

TEST(Networks, TwentyBranchesMeetInOneNode) {
  Network n = blankNetwork();
  n.viscosity = 0.004;
  addSegment(n, 1, 2, 0.1, 0.01, 0.01);
  for (int i = 0; i < 20; ++i) {
    SegmentSpec& s = addSegment(n, 2, 3 + i, 0.05 + 0.01 * i, 0.002 + 1e-4 * i, 0.002);
    s.terminal = true;
    s.load = {1e8, 1e9, 1e-10, 0};
  }
  setHump(n, 2e-4, 0.3);
  const Model model = buildModel(n, 0.005);
  State state = initialState(model);
  std::vector<std::vector<SegmentSample>> history;
  ASSERT_EQ(run(model, {}, 0.5, 0.01, state, &history), Status::kOk);
  for (const auto& row : history) {
    double sum = row[0].distal.flow;
    for (int i = 1; i <= 20; ++i) sum -= row[i].proximal.flow;
    EXPECT_NEAR(sum, 0, 1e-12);
  }
}

TEST(Networks, SeveralSegmentsMayStartAtTheInflow) {
  Network n = blankNetwork();
  for (long end : {2, 3}) {
    SegmentSpec& s = addSegment(n, 1, end, 0.1, 0.005, 0.004);
    s.terminal = true;
    s.load = {1e8, 5e8, 1e-9, 0};
  }
  setHump(n, 1e-4, 0.3);
  const PulseResult result = runPulse(buildModel(n, 0.005), PulseOptions{});
  ASSERT_EQ(result.status, Status::kOk);
  EXPECT_LT(result.mass_error, 1e-9);
  for (const auto& row : result.samples) ASSERT_NEAR(row[0].middle.flow, row[1].middle.flow, 1e-15);
}

TEST(Networks, WallsFromSoftToVeryStiffAndTerminalsWithoutComplianceWork) {
  for (const double modulus : {5e4, 1e6, 1e8}) {
    for (const Windkessel& load : {Windkessel{0, 4e8, 0, 8000}, Windkessel{4e8, 0, 0, 8000},
                                   Windkessel{0, 4e8, 1e-9, 8000}, Windkessel{1e6, 4e8, 1e-13, 9000}}) {
      Network n = mixedNetwork();
      for (auto& s : n.segments) {
        s.youngs_modulus = modulus;
        if (s.terminal) s.load = load;
      }
      setHump(n, 5e-5, 0.3);
      const Model model = buildModel(n, 0.02);
      PulseOptions options;
      options.cycles = 3;
      const PulseResult result = runPulse(model, options);
      ASSERT_EQ(result.status, Status::kOk)
          << modulus << ' ' << load.proximal_resistance << ' ' << load.compliance;
      EXPECT_LT(result.mass_error, 1e-6);
    }
  }
}

TEST(Networks, HalvingTheCellsLowersTheError) {
  const Network n = mixedNetwork();
  const auto run_with = [&](double dx) {
    PulseOptions options;
    options.cycles = 2;
    return runPulse(buildModel(n, dx), options);
  };
  const PulseResult reference = run_with(0.0005);
  const auto error = [&](double dx) {
    const PulseResult r = run_with(dx);
    double sum = 0;
    for (std::size_t i = 0; i < r.time.size(); ++i)
      for (std::size_t k = 0; k < r.samples[i].size(); ++k)
        sum += std::fabs(r.samples[i][k].middle.pressure - reference.samples[i][k].middle.pressure);
    return sum;
  };
  const double coarse = error(0.008), middle = error(0.004), fine = error(0.002);
  std::printf("error against dx = 0.5 mm falls by %.2f and %.2f\n", coarse / middle, middle / fine);
  EXPECT_LT(middle, 0.5 * coarse);
  EXPECT_LT(fine, 0.5 * middle);
}
