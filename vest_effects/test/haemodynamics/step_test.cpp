// The promises of step(): same bits for any number of threads and kernel level, no allocation, last good
// state.

#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <new>

#include "kernel.h"
#include "networks.h"

using namespace vest::haemodynamics;
using namespace vest::haemodynamics::testing;

namespace {
std::atomic<long> g_allocations{0};
}

// noinline: the compiler would pair malloc with delete and warn.
[[gnu::noinline]] void* operator new(std::size_t size) {
  ++g_allocations;
  if (void* p = std::malloc(size ? size : 1)) return p;
  throw std::bad_alloc();
}
[[gnu::noinline]] void operator delete(void* p) noexcept {
  std::free(p);
}
[[gnu::noinline]] void operator delete(void* p, std::size_t) noexcept {
  std::free(p);
}

namespace {

Inputs wounded() {
  Inputs inputs;
  inputs.hole_count = 1;
  inputs.holes[0] = {1, 0.05, 2e-6, 0.6, 0};
  inputs.closure_count = 1;
  inputs.closures[0] = {2, 0.05, 0.3};
  return inputs;
}

}  // namespace

TEST(Step, AnyNumberOfThreadsGivesTheSameBits) {
  const Model model = buildModel(mixedNetwork(), 0.004);
  State one = initialState(model);
  ASSERT_EQ(run(model, wounded(), 0.1, 1e-3, one), Status::kOk);
  for (const int threads : {2, 3, 8}) {
    State many = initialState(model);
    ASSERT_EQ(run(model, wounded(), 0.1, 1e-3, many, nullptr, threads), Status::kOk);
    EXPECT_EQ(many.area, one.area) << threads;
    EXPECT_EQ(many.velocity, one.velocity) << threads;
    EXPECT_EQ(many.windkessel_pressure, one.windkessel_pressure) << threads;
    EXPECT_EQ(many.node_volume, one.node_volume) << threads;
    EXPECT_EQ(many.leak_volume, one.leak_volume) << threads;
    EXPECT_EQ(many.hole_flow, one.hole_flow) << threads;
  }
}

TEST(Step, ASnapshotContinuesWithTheSameBits) {
  const Model model = buildModel(mixedNetwork(), 0.004);
  State straight = initialState(model);
  ASSERT_EQ(run(model, wounded(), 0.2, 1e-3, straight), Status::kOk);
  State first = initialState(model);
  ASSERT_EQ(run(model, wounded(), 0.1, 1e-3, first), Status::kOk);
  State second = first;
  ASSERT_EQ(run(model, wounded(), 0.1, 1e-3, second), Status::kOk);
  EXPECT_EQ(second.area, straight.area);
  EXPECT_EQ(second.velocity, straight.velocity);
}

TEST(Step, AllocatesNothing) {
  const Model model = buildModel(mixedNetwork(), 0.004);
  State state = initialState(model);
  Scratch scratch(model);
  const Inputs inputs = wounded();
  std::vector<SegmentSample> now(model.segments.size());
  ASSERT_EQ(step(model, inputs, 1e-3, state, scratch).status, Status::kOk);
  const long before = g_allocations;
  ASSERT_EQ(step(model, inputs, 0.05, state, scratch).status, Status::kOk);
  ASSERT_TRUE(sample(model, inputs, state, scratch, now));
  EXPECT_EQ(g_allocations, before);
}

TEST(Step, AFailedStepLeavesTheStateAsItWas) {
  Network n = mixedNetwork();
  setHump(n, 0.5, 0.3);  // half a cubic metre a second
  const Model model = buildModel(n, 0.004);
  State state = initialState(model);
  Scratch scratch(model);
  StepReport report;
  State before = state;
  for (int i = 0; i < 300 && report.status == Status::kOk; ++i) {
    before = state;
    report = step(model, {}, 1e-3, state, scratch);
  }
  ASSERT_NE(report.status, Status::kOk);
  EXPECT_EQ(state.area, before.area);
  EXPECT_EQ(state.velocity, before.velocity);
  EXPECT_EQ(state.time, before.time);
  EXPECT_EQ(state.node_volume, before.node_volume);
}

TEST(Step, ANetworkThatWouldRunForHoursIsRefusedAtOnce) {
  Network n = mixedNetwork();
  for (SegmentSpec& s : n.segments) s.youngs_modulus = 1e16;  // waves of some 800 km/s
  const Model model = buildModel(n, 0.004);
  State state = initialState(model);
  Scratch scratch(model);
  EXPECT_EQ(step(model, {}, 1e-6, state, scratch).status, Status::kTooManySubsteps);
}

TEST(Step, NanInTheStateAndInputsOutOfRangeAreReported) {
  const Model model = buildModel(mixedNetwork(), 0.004);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  Scratch scratch(model);
  for (double bad : {nan, -1.0, std::numeric_limits<double>::infinity()}) {
    State state = initialState(model);
    state.area[3] = bad;
    EXPECT_EQ(step(model, {}, 1e-3, state, scratch).status, Status::kNotFinite);
  }
  State state = initialState(model);
  std::vector<Inputs> inputs(9);
  inputs[0].heart_rate_scale = -1;
  inputs[1].flow_scale = nan;
  inputs[2].resistance_scale = 0;
  inputs[3].hole_count = kMostHoles + 1;
  inputs[4] = inputs[5] = inputs[6] = inputs[7] = wounded();
  inputs[4].holes[0].segment = 99;
  inputs[5].holes[0].area = nan;
  inputs[6].closures[0].opening = 1.5;
  inputs[7].closures[0].station = -0.1;
  inputs[8].outflow_pressure_offset = nan;
  for (const Inputs& in : inputs) EXPECT_EQ(step(model, in, 1e-3, state, scratch).status, Status::kBadInput);
  EXPECT_EQ(step(model, {}, nan, state, scratch).status, Status::kBadInput);
  EXPECT_EQ(step(model, {}, 1e-3, state, scratch).status, Status::kOk);
}

// On a processor without AVX2 the selected level is the baseline itself.
TEST(Step, TheSelectedKernelLevelGivesTheBitsOfTheBaseline) {
  for (int n : {2, 3, 4, 5, 7, 8, 31, 64}) {
    unsigned seed = 12345u + static_cast<unsigned>(n);
    const auto random = [&seed] { return (seed = seed * 1664525u + 1013904223u) / 4294967296.0; };
    std::vector<double> s0(n), beta(n), fs(n + 1), fib(n + 1), fhrb(n + 1), area(n), velocity(n);
    for (int i = 0; i <= n; ++i) {
      fs[i] = 0.005 + 0.001 * random();
      const double b = 1e6 * (1 + random());
      fib[i] = 1 / b;
      fhrb[i] = 530 * b;
      if (i == n) break;
      s0[i] = 0.005 + 0.001 * random();
      beta[i] = 1e6 * (1 + random());
      area[i] = s0[i] * s0[i] * (0.95 + 0.1 * random());
      velocity[i] = random() - 0.5;
    }
    const auto advance = [&](const kernel::Kernels& k) {
      std::vector<double> a = area, u = velocity;
      std::vector<std::vector<double>> w(9, std::vector<double>(n + 1, 0.0));
      kernel::SegmentView v{n,           200.0,       1 / 1060.0,  1e-4,        s0.data(),
                            beta.data(), fs.data(),   fib.data(),  fhrb.data(), a.data(),
                            u.data(),    w[0].data(), w[1].data(), w[2].data(), w[3].data(),
                            w[4].data(), w[5].data(), w[6].data(), w[7].data(), w[8].data()};
      std::vector<double> out{k.survey(v), k.fluxes(v, 1e-4)};
      k.update(v, 1e-4);
      out.insert(out.end(), a.begin(), a.end());
      out.insert(out.end(), u.begin(), u.end());
      for (double x : out) EXPECT_TRUE(std::isfinite(x));
      return out;
    };
    EXPECT_EQ(advance(kernel::kBaseline), advance(kernel::selected())) << n;
  }
}
