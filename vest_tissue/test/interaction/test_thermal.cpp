#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "../../src/verbs/heat_step.h"
#include "vest_tissue/base/elementary.h"
#include "vest_tissue/interaction/heat.h"
#include "vest_tissue/interaction/thermal.h"

namespace {

using namespace vest::interaction;

TEST(Elementary, ExponentialAndSineAreExactEnoughForAStep) {
  for (double x = -690.0; x < 690.0; x += 0.37)
    ASSERT_NEAR(vest::base::exponential(x) / std::exp(x), 1.0, 1e-14) << x;
  EXPECT_EQ(vest::base::exponential(0.0), 1.0);
  EXPECT_EQ(vest::base::exponential(-1e9), 0.0);
  EXPECT_TRUE(std::isfinite(vest::base::exponential(1e9)));
  for (double t = -3.0; t < 3.0; t += 0.0013)
    ASSERT_NEAR(vest::base::sineOfTurns(t), std::sin(2.0 * M_PI * t), 1e-11) << t;
}

/// Excess temperature of a net of knots after a time, by links alone.
std::vector<double> conducted(std::vector<double> excess, const std::vector<HeatLink>& links,
                              const std::vector<double>& g, const std::vector<double>& capacity, double dt,
                              int steps) {
  for (int n = 0; n < steps; ++n) {
    for (std::size_t i = 0; i < links.size(); ++i) {
      const auto p = links[i].knot0, q = links[i].knot1;
      const double flow = exchange(g[i], excess[p], excess[q], capacity[p], capacity[q], dt);
      excess[p] += flow / capacity[p];
      excess[q] -= flow / capacity[q];
    }
  }
  return excess;
}

// Slowest mode of an insulated bar: cos(pi·x/L), decays with (pi/L)²·k/(rho·c).
TEST(Conduction, ABarOfKnotsCoolsLikeTheHeatEquation) {
  const int n = 41;
  const double length = 0.04, dx = length / n, k = 0.5, rho = 1000.0, c = 3600.0, area = 1e-5;
  std::vector<std::array<double, 3>> places;
  std::vector<double> volume, excess, capacity;
  std::vector<HeatLink> links;
  for (int i = 0; i < n; ++i) {
    places.push_back({(i + 0.5) * dx, 0, 0});
    volume.push_back(area * dx);
    capacity.push_back(area * dx * rho * c);
    excess.push_back(10.0 * std::cos(M_PI * (i + 0.5) / n));
    if (i > 0) links.push_back({std::uint32_t(i - 1), std::uint32_t(i), dx});
  }
  std::vector<double> g = linkConductances(places, volume, links, k);
  EXPECT_NEAR(g[20], k * area / dx, 1e-9 * g[20]) << "a chain conducts like the bar";
  // The ends have one link for their whole volume: the cells there are counted by half a length more.
  g.front() = g.back() = k * area / dx;
  const double seconds = 200.0, rate = M_PI * M_PI / (length * length) * k / (rho * c);
  const std::vector<double> end = conducted(excess, links, g, capacity, 0.01, 20000);
  double heat = 0.0;
  for (int i = 0; i < n; ++i) {
    EXPECT_NEAR(end[i], excess[i] * std::exp(-rate * seconds), 0.03) << i;
    heat += end[i] * capacity[i];
  }
  EXPECT_NEAR(heat, 0.0, 1e-9) << "nothing is lost on the way";
}

TEST(Conduction, AShellWithDiagonalsConductsAsItsSheet) {
  const int n = 12;
  const double dx = 0.003, thickness = 0.002, k = 0.5;
  std::vector<std::array<double, 3>> places;
  std::vector<HeatLink> links;
  const auto at = [n](int i, int j) { return std::uint32_t(i * n + j); };
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j) {
      places.push_back({i * dx, j * dx, 0});
      if (i + 1 < n) links.push_back({at(i, j), at(i + 1, j), dx});
      if (j + 1 < n) links.push_back({at(i, j), at(i, j + 1), dx});
      if (i + 1 < n && j + 1 < n) links.push_back({at(i, j), at(i + 1, j + 1), std::sqrt(2.0) * dx});
      if (i + 1 < n && j > 0) links.push_back({at(i, j), at(i + 1, j - 1), std::sqrt(2.0) * dx});
    }
  }
  const std::vector<double> volume(places.size(), dx * dx * thickness);
  const std::vector<double> g = linkConductances(places, volume, links, k);
  // Flow through the line between rows 5 and 6 under a gradient of 1 K/m, per knot of the middle columns.
  double flow = 0.0;
  for (std::size_t l = 0; l < links.size(); ++l) {
    const int i0 = static_cast<int>(links[l].knot0) / n, i1 = static_cast<int>(links[l].knot1) / n;
    const int j0 = static_cast<int>(links[l].knot0) % n;
    if (i0 == 5 && i1 == 6 && j0 >= 3 && j0 < 9) flow += g[l] * dx;
  }
  EXPECT_NEAR(flow, k * thickness * 6 * dx, 1e-9 * flow);
}

TEST(Conduction, IsStableAtAnyStepAndConservesHeat) {
  const std::vector<HeatLink> links{{0, 1, 0.001}, {1, 2, 0.001}, {0, 2, 0.001}};
  const std::vector<double> g{1e6, 1e9, 1.0}, capacity{1e-6, 2.0, 0.3};
  const std::vector<double> end = conducted({500.0, 0.0, 3.0}, links, g, capacity, 10.0, 50);
  double heat = 0.0;
  for (int i = 0; i < 3; ++i) {
    EXPECT_GE(end[i], 0.0);
    EXPECT_LE(end[i], 500.0);
    heat += end[i] * capacity[i];
  }
  EXPECT_NEAR(heat, 500.0 * 1e-6 + 0.9, 1e-9);
}

TEST(Column, PerfusionCoolsExponentially) {
  ThermalMaterial m;
  m.perfusion = 0.01;
  HeatColumn c;
  HeatLedger ledger;
  const ColumnShape shape = columnShape(1e-6, 0.0);  // no surface: blood alone
  deliver(c, shape, m, 1e-3, 4.0 * m.heat_capacity * 1e-3, true, ledger);
  ASSERT_NEAR(c.excess[0], 4.0, 1e-12);
  for (int i = 0; i < 30000; ++i) stepColumn(c, shape, m, 1e-3, 1000.0, 0.001, ledger);
  const double rate = kBloodHeat * m.perfusion / (1000.0 * m.heat_capacity);
  EXPECT_NEAR(c.excess[0], 4.0 * std::exp(-rate * 30.0), 1e-4 * 4.0);
  EXPECT_NEAR(ledger.delivered - ledger.perfused, storedHeat(c, shape, m, 1e-3), 1e-9);
}

// Surface held hot: the depth follows Fourier; in the steady state the flow through all layers is the same.
TEST(Column, DepthConductsAsAWallOfItsThickness) {
  ThermalMaterial m;
  m.perfusion = 0.0;
  const double area = 1e-4, thickness = 0.01, mass = area * thickness * 1000.0;
  const ColumnShape shape = columnShape(area * thickness, area);
  ASSERT_NEAR(shape.share[0] + shape.share[1] + shape.share[2] + shape.share[3], 1.0, 1e-12);
  ASSERT_NEAR(shape.share[0] * thickness, 0.4e-3, 1e-12);
  HeatColumn c;
  HeatLedger ledger;
  const double power = 0.02;  // W through the surface: nothing denatures
  for (int i = 0; i < 200000; ++i) {
    deliver(c, shape, m, mass, power * 0.01, false, ledger);
    stepColumn(c, shape, m, mass, 1000.0, 0.01, ledger);
    const double last = c.excess[3];  // taken out at the bottom, at the rate of its inflow
    if (i == 199999) {
      // Quasi-steady: every layer warms alike, so the flow falls linearly to the depth.
      const double flow01 = m.conductivity * area * (c.excess[0] - c.excess[1]) / 0.6e-3;
      const double loss = kSurfaceLoss * area * c.excess[0];
      const double into = power - loss;
      EXPECT_NEAR(flow01, into * (1.0 - shape.share[0]), 0.02 * into);
      EXPECT_GT(c.excess[0], last);
    }
  }
  EXPECT_NEAR(ledger.delivered, 40.0, 1e-6);
  EXPECT_NEAR(ledger.delivered,
              storedHeat(c, shape, m, mass) + ledger.perfused + ledger.surface + ledger.latent, 1e-6 * 40.0);
}

// The hook's power comes in each step of the tissue, and what heat does is stepped more seldom: nobody sees
// it.
TEST(Denaturation, IsTheSameInStepsOfHeatAsInThoseOfTheTissue) {
  ThermalMaterial m;
  m.perfusion = 0.005;
  const double area = 2e-5, thickness = 0.004, mass = area * thickness * 1000.0;
  const ColumnShape shape = columnShape(area * thickness, area);
  const auto burn = [&](int every) {
    HeatColumn c;
    HeatLedger ledger;
    for (int i = 1; i <= 4000; ++i) {  // 6 W for a second, three seconds of rest
      if (i <= 1000) deliver(c, shape, m, mass, 6.0 * 0.001, false, ledger);
      if (i % every == 0) stepColumn(c, shape, m, mass, 1000.0, every * 0.001, ledger);
    }
    EXPECT_NEAR(ledger.delivered - ledger.perfused - ledger.surface - ledger.latent,
                storedHeat(c, shape, m, mass), 1e-9);
    return c;
  };
  const int every = static_cast<int>(std::lround(vest::scene::kHeatStep / 0.001));
  const HeatColumn fine = burn(1), coarse = burn(every), far_too_coarse = burn(500);
  ASSERT_GT(fine.surface, 0.9) << "it whitens";
  ASSERT_LT(fine.denatured, 0.9) << "but not through and through";
  EXPECT_NEAR(coarse.denatured, fine.denatured, 0.01);
  EXPECT_NEAR(coarse.dried[0], fine.dried[0], 0.01);
  for (std::size_t l = 0; l < kThermalLayers; ++l) EXPECT_NEAR(coarse.excess[l], fine.excess[l], 0.2) << l;
  EXPECT_GT(std::fabs(far_too_coarse.denatured - fine.denatured), 0.01) << "steps do count";
}

TEST(Denaturation, FollowsArrheniusAtConstantTemperature) {
  ThermalMaterial m;
  m.perfusion = 0.0;
  for (const double kelvin : {323.15, 328.15, 333.15, 338.15}) {
    HeatColumn c;
    HeatLedger ledger;
    const ColumnShape shape = columnShape(1.0, 0.0);
    deliver(c, shape, m, 1.0, (kelvin - kBodyTemperature) * m.heat_capacity, true, ledger);
    for (int i = 0; i < 1000; ++i) stepColumn(c, shape, m, 1.0, 1000.0, 0.001, ledger);
    const double omega = 3.1e98 * std::exp(-6.28e5 / (8.314462618 * kelvin));
    EXPECT_NEAR(c.arrhenius[0], std::min(omega, 40.0), 1e-6 * omega) << kelvin;
    EXPECT_NEAR(c.denatured, 1.0 - std::exp(-omega), 1e-6) << kelvin;
  }
  EXPECT_NEAR(denaturationRate(333.15), 1.0, 0.1) << "60 degrees for one second is the threshold in print";
  EXPECT_LT(denaturationRate(316.15), 1e-4) << "fever does no harm";
}

TEST(Denaturation, WaterHoldsTheTemperatureAtBoilingUntilItIsGoneThenTissueChars) {
  ThermalMaterial m;
  m.perfusion = 0.0;
  const ColumnShape shape = columnShape(1e-6, 0.0);
  HeatColumn c;
  HeatLedger ledger;
  const double mass = 1e-3, to_boil = mass * m.heat_capacity * (kBoiling - kBodyTemperature),
               water = mass * m.water * kLatentHeat;
  double energy = 0.0;
  while (energy < to_boil + 0.5 * water) {
    deliver(c, shape, m, mass, 1.0, true, ledger), energy += 1.0;
    stepColumn(c, shape, m, mass, 1000.0, 0.01, ledger);
  }
  EXPECT_NEAR(c.excess[0] + kBodyTemperature, kBoiling, 1e-6);
  EXPECT_NEAR(c.dried[0], 0.5, 0.01);
  EXPECT_EQ(c.charred, 0.0);
  while (energy < to_boil + water + mass * m.heat_capacity * 100.0) {
    deliver(c, shape, m, mass, 1.0, true, ledger), energy += 1.0;
    stepColumn(c, shape, m, mass, 1000.0, 0.01, ledger);
  }
  EXPECT_EQ(c.dried[0], 1.0);
  EXPECT_NEAR(c.excess[0] + kBodyTemperature, kBoiling + 100.0, 2.0);
  EXPECT_GT(c.charred, 0.05);
  EXPECT_LE(c.charred, 1.0);
  EXPECT_NEAR(ledger.delivered, storedHeat(c, shape, m, mass) + ledger.latent, 1e-9 * ledger.delivered);
}

}  // namespace
