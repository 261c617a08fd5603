#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>

#include "vest_effects/smoke/smoke.h"

// Protects smoke: mass in proportion to energy and accounted, rising and thinning, drawn by suction, and the
// two ways in which it is shown.

namespace vest::smoke {
namespace {

struct Cavity {
  Model model;
  State state;
  Scratch scratch;
  Inputs inputs;
  explicit Cavity(const Parameters& p = Parameters{})
      : model(buildModel(p)), state(initialState(model)), scratch(model) {}
  void coagulate(double seconds, double power = 30) {
    inputs.source_count = 1;
    inputs.sources[0] = {{0.0, 0.05, 0.05}, power * inputs.dt};
    for (double t = 0; t < seconds - 1e-9; t += inputs.dt)
      ASSERT_EQ(step(model, inputs, state, scratch), Status::Ok);
    inputs.source_count = 0;
  }
  void wait(double seconds) {
    for (double t = 0; t < seconds - 1e-9; t += inputs.dt)
      ASSERT_EQ(step(model, inputs, state, scratch), Status::Ok);
  }
  double height() const {
    double sum = 0, moment = 0;
    std::size_t c = 0;
    for (int k = 0; k < model.nz; ++k)
      for (int j = 0; j < model.ny; ++j)
        for (int i = 0; i < model.nx; ++i, ++c)
          sum += state.density[c], moment += state.density[c] * (k + 0.5);
    return moment / sum * model.parameters.cell;
  }
};

TEST(Smoke, ItsMassIsTheYieldTimesTheEnergyAndEveryMilligramIsAccounted) {
  Cavity c;
  c.coagulate(2.0);
  EXPECT_NEAR(c.state.made, 60 * c.model.parameters.yield, 1e-12);
  c.wait(10);
  EXPECT_NEAR(mass(c.model, c.state) + c.state.drawn + c.state.faded, c.state.made, 2e-4 * c.state.made);
  for (const float d : c.state.density) ASSERT_GE(d, 0.0f);
}

TEST(Smoke, RisesAndThinsOverTime) {
  Cavity c;
  c.coagulate(1.0);
  const double start = c.height();
  float most = 0, later = 0;
  for (const float d : c.state.density) most = std::max(most, d);
  c.wait(3);
  EXPECT_GT(c.height(), start + 0.02);
  for (const float d : c.state.density) later = std::max(later, d);
  EXPECT_LT(later, 0.3f * most);
  const double before = mass(c.model, c.state);
  c.inputs.renewal = 1 / 300.0;
  c.wait(30);
  const double rate = c.inputs.renewal + 1 / c.model.parameters.settling;
  EXPECT_NEAR(mass(c.model, c.state), before * std::exp(-30 * rate), 0.01 * before);
}

TEST(Smoke, SuctionNearThePlumeDrawsItAndLeavesLess) {
  Cavity with, without;
  with.inputs.suction_count = 1;
  with.inputs.suctions[0] = {{0.0, 0.05, 0.065}, 3e-4};
  for (Cavity* c : {&with, &without}) c->coagulate(2.0), c->wait(2);
  EXPECT_GT(with.state.drawn, 0.4 * with.state.made) << "the tip follows the coagulation at 15 mm";
  EXPECT_LT(mass(with.model, with.state), 0.6 * mass(without.model, without.state));
  EXPECT_EQ(without.state.drawn, 0.0);
}

TEST(Smoke, AWallThatSinksPushesItDownAndLosesNone) {
  Cavity c;
  c.coagulate(1.0);
  c.wait(4);
  const auto above = [&](double height) {
    double sum = 0;
    for (int k = 0; k < c.model.nz; ++k)
      for (int n = 0; n < c.model.nx * c.model.ny; ++n)
        if (c.model.parameters.low[2] + (k + 0.5) * c.model.parameters.cell > height)
          sum +=
              static_cast<double>(c.state.density[static_cast<std::size_t>(k) * c.model.nx * c.model.ny + n]);
    return sum;
  };
  ASSERT_GT(above(0.12), 0) << "it rose there";
  std::vector<float> ceiling(static_cast<std::size_t>(c.model.nx) * c.model.ny);
  for (double height = 0.2; height > 0.12; height -= 0.001) {
    ceiling.assign(ceiling.size(), static_cast<float>(height));
    c.inputs.ceiling = ceiling.data();
    c.wait(c.inputs.dt);
  }
  c.coagulate(1.0);
  EXPECT_EQ(above(0.12 + c.model.parameters.cell), 0);
  for (std::uint32_t q = 0; q < c.state.puff_count; ++q) EXPECT_LE(c.state.puffs[q].position[2], 0.121F);
  EXPECT_NEAR(mass(c.model, c.state) + c.state.drawn + c.state.faded, c.state.made, 2e-4 * c.state.made);
  for (const float d : c.state.density) ASSERT_GE(d, 0.0f);
}

TEST(Smoke, AClearCavityStaysExactlyClear) {
  Cavity c;
  c.wait(1);
  EXPECT_EQ(mass(c.model, c.state), 0.0);
  EXPECT_EQ(c.state.puff_count, 0u);
}

TEST(Smoke, ShowsTheSameMassByTheTextureAndPuffsByTheirKeys) {
  Cavity c;
  c.coagulate(1.0);
  EXPECT_NEAR(c.state.puff_count, 1.0 / 0.08, 3);
  std::vector<float> drawn(c.state.density.size());
  c.wait(4);
  drawnDensity(c.model, c.state, drawn.data());
  double sum = 0, field = 0;
  for (std::size_t i = 0; i < drawn.size(); ++i) sum += drawn[i], field += c.state.density[i];
  EXPECT_NEAR(sum, field, 0.1 * field);
  EXPECT_EQ(c.state.puff_count, 0u) << "after their life";
  Puff p;
  p.mass = 1e-6f;
  float radius = 0;
  for (p.age = 0; p.age < 3.5f; p.age += 0.1f) {
    const PuffLook look = lookOf(p);
    EXPECT_GT(look.radius, radius) << "a puff grows";
    EXPECT_GE(look.density, 0.0f);
    radius = look.radius;
  }
  EXPECT_NEAR(lookOf(p).density, 0.0f, 1e-4f) << "and is gone at its end";
}

TEST(Smoke, GoesOnFromASnapshotWithTheSameBits) {
  Cavity a, b;
  a.coagulate(0.5);
  std::vector<std::uint8_t> middle, end_a, end_b;
  save(a.state, middle);
  ASSERT_TRUE(restore(b.model, middle.data(), middle.size(), b.state));
  a.wait(1), b.wait(1);
  save(a.state, end_a), save(b.state, end_b);
  EXPECT_TRUE(end_a == end_b);
  EXPECT_FALSE(restore(b.model, middle.data(), middle.size() - 4, b.state));
  const double absurd = 1e300;  // s, of the time
  std::memcpy(middle.data() + sizeof b.state.step, &absurd, sizeof absurd);
  EXPECT_FALSE(restore(b.model, middle.data(), middle.size(), b.state));
  const State good = a.state;
  const auto refused = [&](auto change) {
    State changed = good;
    change(changed);
    middle.clear();
    save(changed, middle);
    return !restore(b.model, middle.data(), middle.size(), b.state);
  };
  EXPECT_FALSE(refused([](State&) {}));
  EXPECT_TRUE(refused([](State& s) { s.density[3] = 1e30f; })) << "no step makes it, the next makes infinity";
  EXPECT_TRUE(refused([](State& s) { s.density[3] = -1.0f; }));
  EXPECT_TRUE(refused([](State& s) { s.puffs[0].position[1] = std::numeric_limits<float>::quiet_NaN(); }));
}

TEST(Smoke, RefusesWhatIsAbsurd) {
  Cavity c;
  c.inputs.dt = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(step(c.model, c.inputs, c.state, c.scratch), Status::BadInput);
  c.inputs.dt = 0.02;
  c.inputs.source_count = 1;
  c.inputs.sources[0] = {{0, 0, 0}, -1};
  EXPECT_EQ(step(c.model, c.inputs, c.state, c.scratch), Status::BadInput);
  EXPECT_EQ(c.state.step, 0u);
  Parameters p;
  p.cell = 1e-4;
  EXPECT_THROW(buildModel(p), std::invalid_argument);
}

}  // namespace
}  // namespace vest::smoke
