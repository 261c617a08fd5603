#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "vest_effects/arithmetic.h"
#include "vest_effects/lens/lens.h"
#include "vest_effects/vapour.h"

// Protects the lens: when it steams up, how fast, what clears it, and the functions that stand in for libm.

namespace vest::lens {
namespace {

TEST(Arithmetic, AgreesWithLibmAndIsTotal) {
  for (double x = -50; x < 50; x += 0.37) EXPECT_NEAR(effects::exponential(x) / std::exp(x), 1.0, 1e-14) << x;
  for (double x = 1e-9; x < 1e9; x *= 1.7) EXPECT_NEAR(effects::logarithm(x), std::log(x), 3e-14) << x;
  for (double y = -2; y < 3; y += 0.13) EXPECT_NEAR(effects::power(7.3, y) / std::pow(7.3, y), 1.0, 1e-13);
  EXPECT_EQ(effects::exponential(-1e6), 0.0);
  EXPECT_EQ(effects::exponential(std::nan("")), 0.0);
  EXPECT_EQ(effects::power(-1, 0.5), 0.0);
}

TEST(Vapour, HasTheTabulatedPressuresAndDewPoints) {
  // Steam tables (IAPWS-IF97): 2339 Pa at 20 °C, 4247 at 30 °C, 6282 at 37 °C.
  EXPECT_NEAR(effects::saturationPressure(293.15), 2339, 0.005 * 2339);
  EXPECT_NEAR(effects::saturationPressure(303.15), 4247, 0.005 * 4247);
  EXPECT_NEAR(effects::saturationPressure(310.15), 6282, 0.005 * 6282);
  EXPECT_NEAR(effects::dewPoint(310.15, 0.95), 309.22, 0.1);
  EXPECT_NEAR(effects::dewPoint(300, 1.0), 300, 1e-6);
}

double fogAfter(double seconds, const Parameters& p, State& s, Inputs in = Inputs{}) {
  for (double t = 0; t < seconds - 1e-9; t += in.dt) EXPECT_EQ(step(p, in, s), Status::Ok);
  return fog(p, s);
}

TEST(Lens, AColdOneSteamsUpAndAWarmOneStaysClear) {
  Parameters p;
  State warm = initialState(p);
  EXPECT_EQ(fogAfter(120, p, warm), 0.0) << "warmed before";
  p.start_temperature = 293.15;
  State cold = initialState(p);
  EXPECT_GT(fogAfter(30, p, cold), 0.3);
  EXPECT_NEAR(fogAfter(1500, p, cold), 0.0, 1e-3)
      << "it takes the cavity's warmth, and the light's, and clears by itself";
  EXPECT_GT(cold.temperature, effects::dewPoint(Inputs{}.temperature, Inputs{}.humidity));
}

TEST(Lens, CondensationFollowsTheFilmTheory) {
  // First step: mass flux = h/(rho c Le^⅔)·(rho_v − rho_s), by hand from the tables.
  Parameters p;
  p.start_temperature = 293.15;
  State s = initialState(p);
  Inputs in;
  step(p, in, s);
  const double rho_v = 0.95 * 6282 / (461.5 * 310.15), rho_s = 2339 / (461.5 * 293.15);
  const double flux = 12.0 / (1.15 * 1005 * std::pow(0.85, 2.0 / 3)) * (rho_v - rho_s);
  EXPECT_NEAR(s.condensate, flux * in.dt, 0.01 * flux * in.dt);
}

TEST(Lens, ClearsByWarmingByWipingByRinsingAndOutside) {
  Parameters p;
  p.start_temperature = 293.15;
  State fogged = initialState(p);
  const double before = fogAfter(40, p, fogged);
  State waits = fogged, warmed = fogged, wiped = fogged, rinsed = fogged, outside = fogged;
  Inputs warm, wipe, rinse, out;
  warm.warmed = wipe.wiped = rinse.rinsed = out.outside = true;
  EXPECT_GT(fogAfter(8, p, waits), 0.8 * before);
  EXPECT_LT(fogAfter(60, p, warmed, warm), 0.1 * before);
  EXPECT_LT(fogAfter(2, p, wiped, wipe), 0.2 * before);
  EXPECT_LT(fogAfter(2, p, rinsed, rinse), 0.3 * before);
  EXPECT_LT(fogAfter(4, p, outside, out), 0.05 * before);
}

TEST(Lens, ASplashSoilsItsPlaceWithBloodAndARinseTakesItOff) {
  Parameters p;
  State s = initialState(p);
  Inputs in;
  in.hit_count = 1;
  in.hits[0] = {0.5f, -0.5f, 8e-9f, 1.0f};
  step(p, in, s);
  const auto at = [&](double u, double v) {
    return static_cast<std::size_t>(static_cast<int>((v + 1) / 2 * kRows) * kColumns +
                                    static_cast<int>((u + 1) / 2 * kColumns));
  };
  EXPECT_GT(s.soiling[at(0.5, -0.5)], 0.5f);
  EXPECT_EQ(s.blood[at(0.5, -0.5)], 1.0f);
  EXPECT_EQ(s.soiling[at(-0.8, 0.8)], 0.0f);
  in.hit_count = 0;
  fogAfter(1, p, s, in);
  EXPECT_GT(s.soiling[at(0.5, -0.5)], 0.5f) << "blood does not go by itself";
  in.rinsed = true;
  fogAfter(5, p, s, in);
  EXPECT_EQ(s.soiling[at(0.5, -0.5)], 0.0f);
}

TEST(Lens, FogIsThickerHereThanThere) {
  Parameters p;
  p.start_temperature = 293.15;
  State s = initialState(p);
  fogAfter(30, p, s);
  const auto [least, most] = std::minmax_element(s.water.begin(), s.water.end());
  EXPECT_LT(*least, 0.85f * static_cast<float>(s.condensate));
  EXPECT_GT(*most, 1.15f * static_cast<float>(s.condensate));
  double sum = 0;
  for (const float w : s.water) sum += static_cast<double>(w);
  EXPECT_NEAR(sum / static_cast<double>(s.water.size()), s.condensate, 1e-9);
  EXPECT_GT(fogAt(p, s, static_cast<std::size_t>(most - s.water.begin())), fog(p, s));
}

TEST(Lens, ADropTooLargeToStickRunsDownAndTakesTheFogOnItsWayAlong) {
  Parameters p;
  p.start_temperature = 293.15;
  State fogged = initialState(p);
  fogAfter(20, p, fogged);
  const auto at = [&](const State& s, double u, double v) {
    return s.water[static_cast<std::size_t>(static_cast<int>((v + 1) / 2 * kRows) * kColumns +
                                            static_cast<int>((u + 1) / 2 * kColumns))];
  };
  for (const bool large : {true, false}) {
    State s = fogged;
    Inputs in;
    in.hit_count = 1;
    in.hits[0] = {0.1f, -0.6f, large ? 8e-9f : 1e-9f, 0.0f};
    ASSERT_EQ(step(p, in, s), Status::Ok);
    in.hit_count = 0;
    fogAfter(0.7, p, s, in);
    if (large) {
      EXPECT_LT(at(s, 0.1, 0.0), 0.6f * at(fogged, 0.1, 0.0)) << "its track is clear";
    } else {
      EXPECT_GT(at(s, 0.1, 0.0), 0.9f * at(fogged, 0.1, 0.0)) << "a small one sticks";
    }
    EXPECT_GT(at(s, -0.6, 0.0), 0.9f * at(fogged, -0.6, 0.0)) << "beside it nothing has changed";
    fogAfter(3, p, s, in);
    for (const auto& run : s.runs) EXPECT_EQ(run.mass, 0.0f) << "it has run off, or all of it sticks";
  }
  State sideways = fogged;
  Inputs in;
  in.down = {1, 0};
  in.hit_count = 1;
  in.hits[0] = {-0.6f, 0.1f, 8e-9f, 0.0f};
  ASSERT_EQ(step(p, in, sideways), Status::Ok);
  in.hit_count = 0;
  fogAfter(0.7, p, sideways, in);
  EXPECT_LT(at(sideways, 0.0, 0.1), 0.6f * at(fogged, 0.0, 0.1)) << "along gravity, as the camera is held";
}

TEST(Lens, CondensateOfMoreThanItHoldsRunsOff) {
  Parameters p;
  p.start_temperature = 280, p.drip = 0.003;
  State s = initialState(p);
  fogAfter(40, p, s);
  for (const float w : s.water) EXPECT_LE(w, 0.0031f) << "kg/m²";
  EXPECT_GT(s.condensate, 0.0005);
}

TEST(Lens, SmokeBlackensItAllOver) {
  Parameters p;
  State s = initialState(p);
  Inputs in;
  in.smoke = 2e-3;
  fogAfter(10, p, s, in);
  for (const float x : s.soiling) EXPECT_NEAR(x, 1 - std::exp(-2e-3 * 0.002 * 10 / 1e-4), 0.02);
}

TEST(Lens, RefusesWhatIsAbsurdAndASnapshotThatIsNotItsOwn) {
  Parameters p;
  State s = initialState(p);
  Inputs in;
  in.hit_count = 1;
  in.hits[0].u = std::numeric_limits<float>::quiet_NaN();
  EXPECT_EQ(step(p, in, s), Status::BadInput);
  EXPECT_EQ(s.step, 0u);
  std::vector<std::uint8_t> bytes;
  save(s, bytes);
  State t;
  EXPECT_TRUE(restore(bytes.data(), bytes.size(), t));
  EXPECT_FALSE(restore(bytes.data(), bytes.size() - 1, t));
  in.hit_count = 0, in.humidity = 1.5;
  EXPECT_EQ(step(p, in, s), Status::BadInput);
  p.outside_temperature = 1.5;
  EXPECT_THROW(check(p), std::invalid_argument);
}

TEST(Lens, TissueCoveredWithBloodSoilsIt) {
  const Parameters p;
  State clean = initialState(p), bloody = clean;
  for (float& x : bloody.soiling) x = 0.5f;
  Inputs in;
  in.wiped = true;
  for (int k = 0; k < 200; ++k) ASSERT_EQ(step(p, in, bloody), Status::Ok);
  EXPECT_LT(bloody.soiling[0], 0.01f) << "moist tissue wipes";
  in.wiped_on_blood = 0.8f;
  for (int k = 0; k < 200; ++k) ASSERT_EQ(step(p, in, clean), Status::Ok);
  EXPECT_NEAR(clean.soiling[0], 0.8f, 0.03f);
  EXPECT_GT(clean.blood[0], 0.95f);
}

}  // namespace
}  // namespace vest::lens
