#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "vest_effects/gas/gas.h"

// Protects the pneumoperitoneum: pressures and volumes of an ideal gas in an elastic wall, leaks as theory
// has them, no gas that appears or vanishes, and steps whose size does not matter.

namespace vest::gas {
namespace {

void run(const Parameters& p, State& s, double seconds, Inputs in = Inputs{}) {
  for (double t = 0; t < seconds - 1e-9; t += in.dt) ASSERT_EQ(step(p, in, s), Status::Ok);
}

TEST(Gas, HoldsItsPressureWithTheFlowThatLeaksAndIsAbsorbed) {
  const Parameters p;
  State s = initialState(p);
  EXPECT_NEAR(condition(p, s).pressure, p.set_pressure, 1e-6);
  run(p, s, 120);
  const Condition c = condition(p, s);
  EXPECT_NEAR(c.pressure, p.set_pressure, 40) << "0.3 mmHg of droop";
  EXPECT_NEAR(c.volume, p.slack_volume + p.compliance * c.pressure, 1e-9);
  EXPECT_NEAR(c.flow, c.leak + p.absorption, 0.01 * c.flow) << "at rest what comes in goes out";
  // The orifice by hand: 96.6 kPa of carbon dioxide and 6.3 kPa of vapour at 37 °C weigh 1.69 kg/m³; what
  // leaves is counted dry at 101.3 kPa and 21 °C.
  const double counted = 96.6 / 310.15 / (101.3 / 294.15);
  EXPECT_NEAR(c.leak, 0.6 * p.leak_area * std::sqrt(2 * c.pressure / 1.69) * counted, 0.01 * c.leak);
}

TEST(Gas, NothingAppearsAndNothingVanishes) {
  Parameters p;
  State s = initialState(p);
  const double before = s.gas;
  Inputs in;
  for (int k = 0; k < 20'000; ++k) {
    in.suction = k % 700 < 300 ? 6e-4 : 0;
    p.leak_area = k % 1100 < 90 ? 2e-5 : 6.5e-7;
    ASSERT_EQ(step(p, in, s), Status::Ok);
  }
  EXPECT_NEAR(s.gas - before, s.supplied - s.leaked - s.absorbed - s.drawn, 1e-12);
  EXPECT_GT(s.drawn, before);
}

TEST(Gas, LeaksDownAsTheOrificeSays) {
  // C dp/dt = −0.6 A sqrt(2p/rho), so that sqrt(p) falls linearly in time; the gas' own expansion adds
  // V/101 kPa to C, 2 %.
  Parameters p;
  p.max_flow = 0, p.absorption = 0, p.leak_area = 4e-6;
  State s = initialState(p);
  const double rho = (s.gas * 0.04401 + s.vapour * 0.018015) / condition(p, s).volume;
  const double compliance = p.compliance + (p.slack_volume + 0.75 * p.compliance * p.set_pressure) / 102e3;
  run(p, s, 20);
  const double root =
      std::sqrt(p.set_pressure) - 0.6 * p.leak_area * std::sqrt(2 / rho) / (2 * compliance) * 20;
  EXPECT_NEAR(condition(p, s).pressure, root * root, 0.02 * p.set_pressure);
  run(p, s, 300);
  EXPECT_NEAR(condition(p, s).pressure, 0, 1e-3 * p.set_pressure);
  EXPECT_NEAR(condition(p, s).volume, p.slack_volume, 0.02 * p.slack_volume)
      << "leaks end at the air's pressure";
}

TEST(Gas, FillsWithinTheTimeThatItsFlowNeeds) {
  Parameters p;
  p.leak_area = 0, p.absorption = 0, p.max_flow = 1e-4;  // 6 l/min
  State s = initialState(p);
  Inputs suck;
  suck.suction = 0.01;
  Parameters off = p;
  off.max_flow = 0;
  run(off, s, 5, suck);
  EXPECT_EQ(condition(p, s).pressure, 0) << "the field has collapsed";
  const double missing = 0.9 * (p.slack_volume + p.compliance * p.set_pressure);
  run(p, s, 0.5 * missing / p.max_flow);
  EXPECT_LT(condition(p, s).pressure, 0.6 * p.set_pressure);
  run(p, s, 1.0 * missing / p.max_flow);
  EXPECT_NEAR(condition(p, s).pressure, p.set_pressure, 0.05 * p.set_pressure);
}

TEST(Gas, SuctionStrongerThanTheInsufflatorCollapsesTheField) {
  Parameters p;
  p.max_flow = 1e-4;
  State weak = initialState(p), strong = weak;
  Inputs little, much;
  little.suction = 0.5e-4, much.suction = 5e-4;
  run(p, weak, 60, little), run(p, strong, 60, much);
  EXPECT_GT(condition(p, weak).pressure, 0.8 * p.set_pressure);
  EXPECT_EQ(condition(p, strong).pressure, 0);
  EXPECT_LT(condition(p, strong).volume, p.slack_volume);
  EXPECT_GT(strong.gas, 0);
  run(p, strong, 120);
  EXPECT_NEAR(condition(p, strong).pressure, p.set_pressure, 60) << "and comes back";
}

// Protects the wall that is seen to sink: not while the insufflator holds its pressure, all the way as the
// field collapses, and by the volume that a paraboloid of that depth has.
TEST(Gas, TheWallSinksByTheVolumeThatIsLost) {
  Parameters p;
  State s = initialState(p);
  EXPECT_NEAR(condition(p, s).sunk, 0, 1e-9);
  run(p, s, 60);
  EXPECT_LT(condition(p, s).sunk, 0.001) << "not seen";
  const double roof = kRoof * p.wall_area;
  p.max_flow = 0, p.leak_area = 2e-5;
  double before = 0;
  for (int k = 0; k < 30; ++k) {
    run(p, s, 1);
    const Condition c = condition(p, s);
    EXPECT_GE(c.sunk, before - 1e-9);
    before = c.sunk;
    EXPECT_NEAR(0.5 * roof * c.sunk, p.slack_volume + p.compliance * p.set_pressure - c.volume, 1e-9);
  }
  EXPECT_GT(before, 0.06) << "12 mmHg of 0.3 l lift 0.1 m² by 7 cm";
  EXPECT_LT(before, 0.09);
  p.max_flow = 3.33e-4, p.leak_area = 6.5e-7;
  run(p, s, 60);
  EXPECT_LT(condition(p, s).sunk, 0.001) << "and comes back";
}

TEST(Gas, DryColdGasMakesTheCavityDrierAndColder) {
  Parameters p;
  State still = initialState(p), blown = still;
  p.leak_area = 0;
  run(p, still, 120);
  EXPECT_GT(condition(p, still).humidity, 0.99);
  p.leak_area = 1.3e-5;  // an open valve: 20 l/min go through
  run(p, blown, 120);
  const Condition c = condition(p, blown);
  // At rest the wall's evaporation makes up for what flows out: k A (c_sat − c) = Q c; heat likewise.
  const double n = blown.gas / c.volume, k = p.heat_transfer / (37.5 * n * 0.897);
  const double out = c.leak * 101325 / (8.314462618 * 294.15) / n;
  const double expected = k * p.wall_area / (k * p.wall_area + out);
  const double vapour = blown.vapour / c.volume, saturated = 6282 / (8.314462618 * 310.15);
  EXPECT_NEAR(vapour / saturated, expected, 0.03);
  EXPECT_LT(c.temperature, 308);
}

TEST(Gas, AWetSurfaceDriesAsChiltonAndColburnSay) {
  // By hand: 5 W/(m²K) over 37.5 J/(mol K) × 39.3 mol/m³ × 0.897 are 3.8 mm/s; 6.28 kPa of vapour at 37 °C
  // are 43.9 g/m³. So dry gas takes 0.167 g/(m² s) off, which are 0.168 µm/s. Gas at the wall's dew point
  // takes nothing.
  Parameters p;
  p.set_pressure = 0;
  State s = initialState(p);
  EXPECT_NEAR(condition(p, s).drying, 0, 1e-12);
  const double mol = s.gas + s.vapour;
  s.gas = mol, s.vapour = 0;
  EXPECT_NEAR(condition(p, s).drying, 1.68e-7, 0.02e-7);
}

TEST(Gas, DoesNotDependOnItsStep) {
  const auto after = [](double dt) {
    Parameters p;
    State s = initialState(p);
    Inputs in;
    in.dt = dt, in.suction = 6e-4;
    run(p, s, 8, in);
    in.suction = 0;
    run(p, s, 4, in);
    return condition(p, s);
  };
  const Condition fine = after(0.001), coarse = after(0.02);
  EXPECT_NEAR(coarse.pressure, fine.pressure, 0.01 * 1600);
  EXPECT_NEAR(coarse.volume, fine.volume, 0.01 * fine.volume);
  EXPECT_NEAR(coarse.temperature, fine.temperature, 0.1);
}

TEST(Gas, RefusesAbsurdInput) {
  Parameters p;
  State s = initialState(p);
  const State before = s;
  Inputs in;
  in.suction = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(step(p, in, s), Status::BadInput);
  in.suction = 0, in.dt = 1;
  EXPECT_EQ(step(p, in, s), Status::BadInput);
  EXPECT_EQ(s.gas, before.gas);
  std::vector<std::uint8_t> bytes;
  save(s, bytes);
  State t;
  EXPECT_TRUE(restore(bytes.data(), bytes.size(), t));
  EXPECT_EQ(t.gas, s.gas);
  EXPECT_FALSE(restore(bytes.data(), bytes.size() - 1, t));
  p.compliance = 0;
  EXPECT_THROW(check(p), std::invalid_argument);
}

}  // namespace
}  // namespace vest::gas
