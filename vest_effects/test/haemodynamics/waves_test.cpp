// What theory says about waves in elastic tubes, and that the solver finds it.

#include <gtest/gtest.h>

#include "networks.h"

using namespace vest::haemodynamics;
using namespace vest::haemodynamics::testing;

namespace {

constexpr double kMs = 1e-3;

// Time at which the pressure hump's centre passes.
double centroid(const std::vector<std::vector<SegmentSample>>& history, Sample SegmentSample::*site,
                double p_ref) {
  double sum = 0, moment = 0;
  for (std::size_t i = 0; i < history.size(); ++i) {
    const double p = (history[i][0].*site).pressure - p_ref;
    sum += p;
    moment += p * static_cast<double>(i) * kMs;
  }
  return moment / sum;
}

}  // namespace

TEST(Waves, SmallPulseTravelsAtTheSpeedOfMoensAndKorteweg) {
  Network n = blankNetwork();
  SegmentSpec& tube = addSegment(n, 1, 2, 1.0, 0.005, 0.005);
  endMatched(n, tube);
  setHump(n, 1e-9, 0.05);
  const Model model = buildModel(n, 0.005);
  State state = initialState(model);
  std::vector<std::vector<SegmentSample>> history;
  ASSERT_EQ(run(model, {}, 0.4, kMs, state, &history), Status::kOk);
  const double delay =
      centroid(history, &SegmentSample::distal, 10000) - centroid(history, &SegmentSample::proximal, 10000);
  const double expected = 1.0 / waveSpeed(n, n.segments[0]);
  EXPECT_NEAR(delay, expected, 0.002 * expected);
}

TEST(Waves, MatchedTerminalReflectsLessThanAThousandth) {
  Network n = blankNetwork();
  SegmentSpec& tube = addSegment(n, 1, 2, 2.0, 0.005, 0.005);
  endMatched(n, tube);
  setHump(n, 1e-8, 0.05);
  const Model model = buildModel(n, 0.005);
  State state = initialState(model);
  std::vector<std::vector<SegmentSample>> history;
  ASSERT_EQ(run(model, {}, 0.7, kMs, state, &history), Status::kOk);
  double incident = 0, reflected = 0;
  for (std::size_t i = 0; i < history.size(); ++i) {
    const double p = std::fabs(history[i][0].middle.pressure - 10000);
    double& greatest = i < 300 ? incident : reflected;
    greatest = std::max(greatest, p);
  }
  EXPECT_GT(incident, 0);
  EXPECT_LT(reflected, 1e-3 * incident);
}

TEST(Waves, JunctionReflectsByItsAdmittances) {
  for (const double daughter : {0.002, 0.0035, 0.006}) {
    Network n = blankNetwork();
    addSegment(n, 1, 2, 2.0, 0.005, 0.005);
    for (long end : {3, 4}) {
      SegmentSpec& s = addSegment(n, 2, end, 1.0, daughter, daughter);
      endMatched(n, s);
    }
    setHump(n, 1e-8, 0.06);
    const Model model = buildModel(n, 0.005);
    State state = initialState(model);
    std::vector<std::vector<SegmentSample>> history;
    const double c = waveSpeed(n, n.segments[0]);
    ASSERT_EQ(run(model, {}, 3.5 / c, kMs, state, &history), Status::kOk);
    double incident = 0, reflected = 0;  // signed extremes
    for (std::size_t i = 0; i < history.size(); ++i) {
      const double p = history[i][0].middle.pressure - 10000;
      double& extreme = static_cast<double>(i) * kMs < 2.0 / c ? incident : reflected;
      if (std::fabs(p) > std::fabs(extreme)) extreme = p;
    }
    const double y1 = 1 / impedance(n, n.segments[0]), y2 = 1 / impedance(n, n.segments[1]);
    EXPECT_NEAR(reflected / incident, (y1 - 2 * y2) / (y1 + 2 * y2), 0.005) << daughter;
  }
}

TEST(Waves, WindkesselEmptiesWithItsTimeConstant) {
  for (const double compliance : {2e-9, 1e-10}) {
    Network n = blankNetwork();
    n.viscosity = 0.4;  // damps the short tube's own ringing; next to nothing flows in it
    SegmentSpec& tube = addSegment(n, 1, 2, 0.01, 0.001, 0.001);
    tube.youngs_modulus = 1e8;  // the tube itself stores nothing to speak of
    tube.terminal = true;
    tube.load = {1e7, 2e8, compliance, 1000};
    const Model model = buildModel(n, 0.002);
    State state = initialState(model);
    setUniformPressure(model, 9000, state);
    std::vector<std::vector<SegmentSample>> history;
    const double tau = 2e8 * compliance;
    ASSERT_EQ(run(model, {}, 0.1, kMs, state, &history), Status::kOk);
    for (int i : {5, 30, 90})
      EXPECT_NEAR(history[i][0].middle.pressure, 1000 + 8000 * std::exp(-i * kMs / tau), 0.002 * 8000) << i;
  }
}

TEST(Waves, SteadyFlowLosesThePressureOfPoiseuille) {
  for (const double profile : {2.0, 9.0}) {
    Network n = blankNetwork();
    n.viscosity = 0.004;
    n.profile = profile;
    SegmentSpec& tube = addSegment(n, 1, 2, 0.5, 0.002, 0.002);
    tube.youngs_modulus = 1e7;
    tube.terminal = true;
    tube.load = {1e9, 0, 0, 9000};
    const double flow = 1e-6;
    setSteady(n, flow);
    const Model model = buildModel(n, 0.01);
    State state = initialState(model);
    ASSERT_EQ(run(model, {}, 3, kMs, state), Status::kOk);
    std::vector<SegmentSample> now(1);
    Scratch scratch(model);
    ASSERT_TRUE(sample(model, {}, state, scratch, now));
    const double a = area(n.segments[0]);
    const double expected = 2 * (profile + 2) * kPi * n.viscosity * flow * 0.5 / (a * a);
    EXPECT_NEAR(now[0].proximal.pressure - now[0].distal.pressure, expected, 0.002 * expected);
    EXPECT_NEAR(now[0].distal.pressure, 9000 + 1e9 * flow, 0.2);
  }
}

TEST(Waves, SmoothWaveConvergesWithSecondOrder) {
  // A steep, finite wave in a tapering tube with friction, before it meets an end; cells averaged onto the
  // coarse grid.
  Network n = blankNetwork();
  n.viscosity = 0.004;
  SegmentSpec& tube = addSegment(n, 1, 2, 1.0, 0.006, 0.005);
  endMatched(n, tube);
  setHump(n, 4e-5, 0.1);
  const auto areas = [&](int cells) {
    const Model model = buildModel(n, 1.0 / cells);
    State state = initialState(model);
    EXPECT_EQ(run(model, {}, 0.14, 0.02, state), Status::kOk);
    return state.area;
  };
  const int fine = 3200;
  const auto reference = areas(fine);
  const auto error = [&](int cells) {
    const auto coarse = areas(cells);
    const int ratio = fine / cells;
    double sum = 0;
    for (int i = 0; i < cells; ++i) {
      double mean = 0;
      for (int j = 0; j < ratio; ++j) mean += reference[i * ratio + j] / ratio;
      sum += std::fabs(coarse[i] - mean) / cells;
    }
    return sum;
  };
  const double e100 = error(100), e200 = error(200), e400 = error(400);
  RecordProperty("order_100_200", std::to_string(std::log2(e100 / e200)));
  RecordProperty("order_200_400", std::to_string(std::log2(e200 / e400)));
  std::printf("observed orders: %.3f %.3f\n", std::log2(e100 / e200), std::log2(e200 / e400));
  EXPECT_GT(std::log2(e100 / e200), 1.8);
  EXPECT_GT(std::log2(e200 / e400), 1.8);
}
