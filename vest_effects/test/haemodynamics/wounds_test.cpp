// Holes and closures: what a cut, a clip and a ligature do to the flow.

#include <gtest/gtest.h>

#include "networks.h"

using namespace vest::haemodynamics;
using namespace vest::haemodynamics::testing;

namespace {

Network steadyTube(double flow) {
  Network n = blankNetwork();
  SegmentSpec& tube = addSegment(n, 1, 2, 0.3, 0.004, 0.004);
  tube.terminal = true;
  tube.load = {2e8, 0, 0, 0};
  setSteady(n, flow);
  return n;
}

}  // namespace

TEST(Wounds, HoleBleedsByTheOrificeEquationAndTheVolumeIsAccountedFor) {
  const Network n = steadyTube(5e-5);
  double error[2];
  const double dx[2] = {0.005, 0.00125};
  for (int k = 0; k < 2; ++k) {
    const Model model = buildModel(n, dx[k]);
    State state = initialState(model);
    Inputs inputs;
    inputs.hole_count = 1;
    inputs.holes[0] = {0, 0.0999, 3e-6, 0.6, 0};
    const double before = volume(model, state);
    std::vector<std::vector<SegmentSample>> history;
    ASSERT_EQ(run(model, inputs, 4, 1e-3, state, &history), Status::kOk);
    const SegmentSample& now = history.back()[0];
    const double leak = state.hole_flow[0];
    // The pressure differs before and behind the hole (the flow slows): the mean of both neighbours.
    const auto pressure = [&](int cell) {
      return 10000 + model.beta[cell] * (std::sqrt(state.area[cell]) - model.sqrt_area_ref[cell]);
    };
    const int cell = static_cast<int>(0.0999 / model.segments[0].dx);
    const double expected =
        0.6 * 3e-6 * std::sqrt(2 * 0.5 * (pressure(cell - 1) + pressure(cell + 1)) / n.density);
    error[k] = std::fabs(leak / expected - 1);
    EXPECT_NEAR(now.distal.flow, 5e-5 - leak, 0.001 * 5e-5);
    const double in = state.node_volume[0], out = -state.node_volume[1];
    EXPECT_NEAR(in - out - state.leak_volume[0], volume(model, state) - before, 1e-9 * in);
  }
  std::printf("hole: leak off the orifice equation by %g (5 mm cells), %g (1.25 mm)\n", error[0], error[1]);
  EXPECT_LT(error[0], 0.01);
  EXPECT_LT(error[1], 0.01);
}

TEST(Wounds, VesselCutThroughEmptiesTowardsTheOutsidePressureWithoutHarm) {
  Network n = steadyTube(0);
  n.segments[0].load.outflow_pressure = 0;
  const Model model = buildModel(n, 0.005);
  State state = initialState(model);
  Inputs inputs;
  inputs.hole_count = 2;
  inputs.holes[0] = {0, 0.15, area(n.segments[0]), 0.6, 0};
  inputs.holes[1] = {0, 0.3, 1e-3, 1.0, 200};  // absurdly large, at the very end
  ASSERT_EQ(run(model, inputs, 3, 1e-3, state), Status::kOk);
  const double out_before = state.node_volume[1];
  ASSERT_EQ(run(model, inputs, 0.001, 1e-3, state), Status::kOk);
  const double out = -(state.node_volume[1] - out_before) / 0.001;
  std::vector<SegmentSample> now(1);
  Scratch scratch(model);
  ASSERT_TRUE(sample(model, inputs, state, scratch, now));
  // What enters by the far hole leaves by the near one and the terminal; the pressure falls between them.
  EXPECT_LT(now[0].distal.pressure, 200);
  EXPECT_GT(now[0].distal.pressure, now[0].middle.pressure);
  EXPECT_GT(state.hole_flow[0], 0);
  EXPECT_NEAR(-state.hole_flow[1], state.hole_flow[0] + out, 0.001 * state.hole_flow[0]);
}

TEST(Wounds, ClosedClipStopsTheFlowAndReflectsTheWaveInFull) {
  Network n = blankNetwork();
  SegmentSpec& tube = addSegment(n, 1, 2, 2.0, 0.005, 0.005);
  endMatched(n, tube);
  setHump(n, 1e-8, 0.05);
  const Model model = buildModel(n, 0.005);
  Inputs inputs;
  inputs.closure_count = 2;  // two at one place: the narrower counts
  inputs.closures[0] = {0, 1.5, 0.7};
  inputs.closures[1] = {0, 1.5, 0};
  State state = initialState(model);
  std::vector<std::vector<SegmentSample>> history;
  ASSERT_EQ(run(model, inputs, 0.45, 1e-3, state, &history), Status::kOk);
  double incident = 0, reflected = 0, behind = 0;
  for (std::size_t i = 0; i < history.size(); ++i) {
    double& extreme = static_cast<double>(i) < 300 ? incident : reflected;
    extreme = std::max(extreme, history[i][0].middle.pressure - 10000);
    behind = std::max(behind, std::fabs(history[i][0].distal.flow));
  }
  EXPECT_NEAR(reflected / incident, 1, 0.01);
  EXPECT_LT(behind, 1e-6 * 1e-8);
}

TEST(Wounds, PressureBehindAClipFallsToTheOutflowPressure) {
  Network n = mixedNetwork();
  const Model model = buildModel(n, 0.005);
  Inputs inputs;
  inputs.closure_count = 1;
  inputs.closures[0] = {2, 0.05, 0};
  State state = initialState(model);
  ASSERT_EQ(run(model, inputs, 5, 1e-3, state), Status::kOk);
  std::vector<SegmentSample> now(model.segments.size());
  Scratch scratch(model);
  ASSERT_TRUE(sample(model, inputs, state, scratch, now));
  EXPECT_NEAR(now[2].distal.pressure, 500, 20);
  EXPECT_GT(now[0].middle.pressure, 5000);
}

TEST(Wounds, NarrowingCostsThePressureOfItsLossLaw) {
  const double flow = 3e-5, opening = 0.4;
  Network n = steadyTube(flow);
  n.segments[0].youngs_modulus = 1e8;  // equal areas on both sides
  const Model model = buildModel(n, 0.01);
  Inputs inputs;
  inputs.closure_count = 1;
  inputs.closures[0] = {0, 0.15, opening};
  State state = initialState(model);
  ASSERT_EQ(run(model, inputs, 2, 1e-2, state), Status::kOk);
  std::vector<SegmentSample> now(1);
  Scratch scratch(model);
  ASSERT_TRUE(sample(model, inputs, state, scratch, now));
  const double u = flow / area(n.segments[0]);
  const double expected = 1.52 * 0.5 * n.density * (1 / opening - 1) * (1 / opening - 1) * u * u;
  EXPECT_NEAR(now[0].proximal.pressure - now[0].distal.pressure, expected, 0.01 * expected);
}

TEST(Wounds, ScalesOfHeartRateFlowAndResistanceDoWhatTheySay) {
  Network n = steadyTube(2e-5);
  const Model model = buildModel(n, 0.01);
  const auto pressure = [&](double flow, double resistance) {
    Inputs inputs;
    inputs.flow_scale = flow;
    inputs.resistance_scale = resistance;
    State state = initialState(model);
    EXPECT_EQ(run(model, inputs, 4, 1e-2, state), Status::kOk);
    std::vector<SegmentSample> now(1);
    Scratch scratch(model);
    EXPECT_TRUE(sample(model, inputs, state, scratch, now));
    return now[0].distal.pressure;
  };
  EXPECT_NEAR(pressure(1, 1), 4000, 5);
  EXPECT_NEAR(pressure(2, 1), 8000, 10);
  EXPECT_NEAR(pressure(1, 1.5), 6000, 10);
  Inputs faster;
  faster.heart_rate_scale = 1.5;
  State state = initialState(model);
  ASSERT_EQ(run(model, faster, 0.5, 1e-2, state), Status::kOk);
  EXPECT_NEAR(state.phase, 0.75, 1e-9);
}
