#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <limits>

#include "boxes.h"

// Protects the account of volume, the same bits for any number of threads and from a snapshot, and what
// happens at the limits: floods and absurd numbers.

namespace vest::fluid::specimen {
namespace {

/// A basin with a jet into it and suction in its middle.
Fluid basin(int threads, int capacity = 1500) {
  Parameters p;
  p.capacity = capacity;
  Fluid f(p, {openBox(-0.06, 0.06, -0.06, 0.06, 0.1, 8)}, threads);
  f.inputs.source_count = 2;
  f.inputs.sources[0].slot = 1;
  f.inputs.sources[0].position = {0.02, 0, 0.06};
  f.inputs.sources[0].direction = {0.3, 0.1, -1};
  f.inputs.sources[0].area = 2e-5;
  f.inputs.sources[0].flow = 2e-5;
  f.inputs.sources[0].blood = 0;
  f.inputs.sources[1].slot = 130;
  f.inputs.sources[1].position = {-0.03, 0.02, 0.02};
  f.inputs.sources[1].direction = {1, 0, 0.5};
  f.inputs.sources[1].area = 1e-6;
  f.inputs.sources[1].flow = 3e-6;
  f.inputs.sources[1].blood = 1;
  f.inputs.suction_count = 1;
  f.inputs.suctions[0].position = {-0.02, -0.02, 0.002};
  f.inputs.suctions[0].flow = 1.5e-5;
  return f;
}

TEST(Account, NothingIsLostBetweenJetParticlesPoolAndSuction) {
  Fluid f = basin(1);
  for (int k = 0; k < 1500; ++k) {
    f.inputs.renew_bed = k % 12 == 0;
    f.step();
  }
  EXPECT_NEAR(f.state.emitted, 6.0 * 2.3e-5, 1e-9);
  EXPECT_LT(std::fabs(f.gap()), 1e-4 * f.state.emitted);
  EXPECT_LT(f.state.lost, 0.01 * f.state.emitted);
  EXPECT_GT(f.state.sucked, 1e-5) << "the tip stands in the pool";
  EXPECT_GT(poolVolume(f.model, f.state), 1e-5);
}

TEST(Account, WhatFellBehindTheWallComesBackNoFartherThanItFlew) {
  // A plate of 40 mm, and drops below it, 20 mm beside it: some have flown as far, others have just begun.
  Parameters p;
  p.low = {-0.2, -0.2, -0.03};
  const auto pooled = [&](float speed, float age) {
    Fluid f(p, {plate(0.02)});
    f.step();
    f.fill(0.04, 0.0421, 0, 0.0021, -0.0279, -0.0255);
    for (std::size_t i = 0; i < f.state.particles.count; ++i)
      f.state.particles.vx[i] = speed, f.state.particles.age[i] = age;
    for (int k = 0; k < 12; ++k) f.step();
    EXPECT_LT(std::fabs(f.gap()), 1e-4 * f.state.emitted);
    EXPECT_EQ(f.state.particles.count, 0u);
    return poolVolume(f.model, f.state) / f.state.emitted;
  };
  EXPECT_NEAR(pooled(1.2f, 0.05f), 1, 1e-3);
  EXPECT_EQ(pooled(0.0f, 0.02f), 0) << "they were drawn to the plate";
}

TEST(Account, ThePoolIsDilutedToTheMixtureOfItsInflows) {
  Fluid f = basin(1);
  f.inputs.suction_count = 0;
  for (int k = 0; k < 1000; ++k) f.step();
  f.inputs.source_count = 0;
  for (int k = 0; k < 400; ++k) f.step();
  const double volume = poolVolume(f.model, f.state), blood = poolBlood(f.model, f.state);
  ASSERT_GT(volume, 8e-5);
  EXPECT_NEAR(blood / volume, 3.0 / 23.0, 0.02);
}

/// Blood dripped on a rigid floor that falls to one side, then left alone for a while.
Fluid dripped() {
  Parameters p;
  Fluid f(p, {plate(0.06, 0.0, 12)});
  for (std::size_t k = 0; k < f.meshes[0].positions.size(); k += 3)
    f.meshes[0].positions[k + 2] = 0.3f * f.meshes[0].positions[k];
  f.rigid = true, f.inputs.stains = true;
  f.inputs.source_count = 1;
  f.inputs.sources[0].position = {0.03, 0, 0.04};
  f.inputs.sources[0].direction = {0, 0, -1};
  f.inputs.sources[0].area = 3e-6;
  f.inputs.sources[0].flow = 1e-6;
  return f;
}

TEST(Film, BloodThatRanOverTheGroundLeavesATrackAndItsAccountHolds) {
  Fluid f = dripped();
  for (int k = 0; k < 750; ++k) {
    f.inputs.renew_bed = k % 12 == 0;
    f.inputs.sources[0].flow = k < 250 ? 1e-6 : 0;
    f.step();
  }
  const double film = filmVolume(f.model, f.state);
  EXPECT_GT(film, 1e-8) << "m³";
  EXPECT_NEAR(f.gap(), 0, 1e-4 * f.state.emitted);
  // A track down the slope, no blot where it fell.
  const Pools& w = f.state.pools;
  int downhill = 0, uphill = 0;
  for (std::size_t i = 0; i < w.film.size(); ++i) {
    if (!(w.film[i] > 1e-6f)) continue;
    EXPECT_EQ(w.ground[i], w.bed[i]);
    const double x = f.model.parameters.low[0] +
                     (static_cast<double>(i % static_cast<std::size_t>(f.model.columns)) + 0.5) *
                         f.model.parameters.pool_cell;
    (x < 0.02 ? downhill : uphill) += 1;
  }
  EXPECT_GT(downhill, 4) << "cells";
  EXPECT_LT(uphill, downhill + 12);
}

TEST(Film, WaterWashesAFreshOneOffAndASetOneStays) {
  for (const bool fresh : {true, false}) {
    Fluid f = dripped();
    for (std::size_t k = 0; k < f.meshes[0].positions.size(); k += 3) f.meshes[0].positions[k + 2] = 0;
    f.inputs.source_count = 0;
    f.inputs.renew_bed = true;
    f.step();
    const int c = f.model.columns / 2, r = f.model.rows / 2;
    fillCell(f.model, f.state, c, r, 3e-5 * 1.6e-5, 1);
    f.state.emitted += 3e-5 * 1.6e-5;
    for (int k = 0; k < 24; ++k) f.inputs.renew_bed = k % 12 == 0, f.step();
    const double before = filmVolume(f.model, f.state);
    EXPECT_NEAR(before, 3e-5 * 1.6e-5, 1e-13) << "m³: all of it";
    const auto cell =
        static_cast<std::size_t>(r) * static_cast<std::size_t>(f.model.columns) + static_cast<std::size_t>(c);
    if (!fresh) f.state.pools.film_age[cell] = 4 * static_cast<float>(vest::effects::kSettingTime);
    for (int dr = -4; dr <= 4; ++dr)
      for (int dc = -4; dc <= 4; ++dc)
        fillCell(f.model, f.state, c + dc, r + dr, 2e-3 * 1.6e-5, 0), f.state.emitted += 2e-3 * 1.6e-5;
    for (int k = 0; k < 750; ++k) f.inputs.renew_bed = k % 12 == 0, f.step();
    const double after = filmVolume(f.model, f.state);
    if (fresh) {
      EXPECT_LT(after, 0.2 * before) << "after three seconds";
    } else {
      EXPECT_GT(after, 0.95 * before);
    }
    EXPECT_NEAR(f.gap(), 0, 1e-4 * f.state.emitted);
  }
}

TEST(Film, DriesAtItsThinRimFirstAndNotUnderAPool) {
  Fluid f = dripped();
  for (std::size_t k = 0; k < f.meshes[0].positions.size(); k += 3) f.meshes[0].positions[k + 2] = 0;
  f.inputs.source_count = 0;
  f.inputs.renew_bed = true;
  f.step();
  const int c = f.model.columns / 2, r = f.model.rows / 2;
  const auto cell = [&](int column) {
    return static_cast<std::size_t>(r) * static_cast<std::size_t>(f.model.columns) +
           static_cast<std::size_t>(column);
  };
  auto& w = f.state.pools;
  const float film[] = {3e-6f, 5e-5f, 3e-6f};  // m: rim, middle, and a rim under water
  for (int i = 0; i < 3; ++i) w.film[cell(c + 4 * i)] = film[i], w.ground[cell(c + 4 * i)] = 0;
  w.film_age[cell(c + 8)] = 2 * static_cast<float>(effects::kSettingTime);  // it does not go into the water
  fillCell(f.model, f.state, c + 8, r, 1e-3 * 1.6e-5, 0);
  f.inputs.drying = 1.5e-7;  // m/s: dry gas at 37 °C (Gas.AWetSurfaceDriesAsChiltonAndColburnSay)
  for (int k = 0; k < 5000; ++k) f.inputs.renew_bed = k % 12 == 0, f.step();
  const auto set = [&](int i) { return effects::setShare(w.film_age[cell(c + 4 * i)]); };
  EXPECT_GT(set(0), 0.9f) << "20 s; all of its water has gone after 16";
  EXPECT_LT(set(1), 0.01f);
  EXPECT_NEAR(w.film_age[cell(c + 8)], 820, 1) << "s";
}

TEST(Film, GauzeWipesWhatHasNotSet) {
  Fluid f = dripped();
  for (std::size_t k = 0; k < f.meshes[0].positions.size(); k += 3) f.meshes[0].positions[k + 2] = 0;
  f.inputs.source_count = 0;
  f.inputs.renew_bed = true;
  f.step();
  fillCell(f.model, f.state, f.model.columns / 2, f.model.rows / 2, 3e-5 * 1.6e-5, 1);
  f.state.emitted += 3e-5 * 1.6e-5;
  for (int k = 0; k < 24; ++k) f.inputs.renew_bed = k % 12 == 0, f.step();
  const double before = filmVolume(f.model, f.state);
  f.inputs.suction_count = 1;
  f.inputs.suctions[0].flow = 1e-6;
  f.inputs.suctions[0].reach = f.inputs.suctions[0].capture = 0.01;
  f.inputs.suctions[0].soaks = true;
  f.inputs.suctions[0].position = {0, 0, 0.002};
  for (int k = 0; k < 50; ++k) f.step();
  EXPECT_EQ(filmVolume(f.model, f.state), before) << "it hangs over it and touches nothing";
  f.inputs.suctions[0].patch = 0.01;
  for (int k = 0; k < 1250; ++k) f.step();
  EXPECT_LT(filmVolume(f.model, f.state), 0.4 * before) << "after five seconds";
  EXPECT_NEAR(f.state.soaked_blood, before - filmVolume(f.model, f.state), 1e-12);
  EXPECT_NEAR(f.gap(), 0, 1e-4 * f.state.emitted);
}

TEST(Reproduction, TheSameBitsForAnyNumberOfThreadsAndInstructionLevelAndFromASnapshot) {
  std::vector<std::uint8_t> reference, middle;
  for (const int threads : {1, 2, 4}) {
    Fluid f = basin(threads);
    for (int k = 0; k < 200; ++k) f.step();
    if (threads == 1) save(f.state, middle);
    for (int k = 0; k < 60; ++k) f.step();
    std::vector<std::uint8_t> bytes;
    save(f.state, bytes);
    if (threads == 1) reference = bytes;
    EXPECT_TRUE(bytes == reference) << threads << " threads";
  }
  {
    setenv("VEST_KERNEL", "baseline", 1);
    Fluid f = basin(1);
    unsetenv("VEST_KERNEL");
    for (int k = 0; k < 260; ++k) f.step();
    std::vector<std::uint8_t> bytes;
    save(f.state, bytes);
    EXPECT_TRUE(bytes == reference) << "at the baseline level";
  }
  Fluid f = basin(1);
  ASSERT_TRUE(restore(f.model, middle.data(), middle.size(), f.state));
  f.inputs.renew_bed = false;
  for (int k = 0; k < 60; ++k) f.step();
  std::vector<std::uint8_t> bytes;
  save(f.state, bytes);
  EXPECT_TRUE(bytes == reference) << "from the snapshot";
}

TEST(Reproduction, WhatTheScratchKeepsOfMovingTissueChangesNoBit) {
  // The scratch keeps boxes of triangles while knots hardly move: one that is made anew in each step must
  // find the same planes.
  const auto run = [](bool anew) {
    Fluid f = basin(1);
    const Mesh rest = f.meshes[0];
    for (int k = 0; k < 250; ++k) {
      for (std::size_t i = 0; i + 2 < rest.positions.size();
           i += 3) {  // a hump of 15 mm runs along the floor
        const float s = 40 * (rest.positions[i] - 0.0005f * static_cast<float>(k % 200) + 0.05f);
        f.meshes[0].positions[i + 2] = rest.positions[i + 2] + 0.015f * std::max(0.0f, 1 - s * s);
      }
      if (anew) f.scratch = Scratch(f.model, 1);
      f.inputs.renew_bed = k % 12 == 0;
      f.step();
    }
    std::vector<std::uint8_t> bytes;
    save(f.state, bytes);
    return std::make_pair(bytes, f.report.impacts.size());
  };
  const auto kept = run(false), anew = run(true);
  EXPECT_GT(kept.second, 0U);
  EXPECT_TRUE(kept == anew);
}

TEST(Reproduction, WhatIsSparedOnStillTissueChangesNoBit) {
  const auto run = [](bool told) {
    Fluid f = basin(1);
    f.still = told;
    for (int k = 0; k < 200; ++k) f.step();
    std::vector<std::uint8_t> bytes;
    save(f.state, bytes);
    return bytes;
  };
  EXPECT_TRUE(run(true) == run(false));
}

TEST(Reproduction, GroundThatMovedBetweenTwoLooksAndLiesStillAgainIsSeenWhereItLies) {
  Fluid f = dripped();
  f.rigid = true;
  f.inputs.source_count = 0;
  f.inputs.renew_bed = true;
  f.step();
  for (std::size_t k = 2; k < f.meshes[0].positions.size(); k += 3) f.meshes[0].positions[k] -= 0.01f;
  f.step();
  const std::vector<float> before = f.state.pools.bed;
  f.still = true;
  f.inputs.renew_bed = true;
  f.step();
  for (std::size_t i = 0; i < before.size(); ++i)
    ASSERT_NEAR(f.state.pools.bed[i], before[i] > kNoBed ? before[i] - 0.01f : kNoBed, 1e-6f) << i;
}

TEST(Snapshot, BytesOfAnotherModelOrWithBadNumbersAreRefused) {
  Fluid f = basin(1), other = basin(1, 800);
  for (int k = 0; k < 50; ++k) f.step();
  std::vector<std::uint8_t> bytes;
  save(f.state, bytes);
  State state = initialState(other.model);
  EXPECT_FALSE(restore(other.model, bytes.data(), bytes.size(), state));
  EXPECT_FALSE(restore(f.model, bytes.data(), bytes.size() - 1, state));
  const State good = f.state;
  const auto refused = [&](auto change) {
    f.state = good;
    change(f.state);
    bytes.clear();
    save(f.state, bytes);
    return !restore(f.model, bytes.data(), bytes.size(), state);
  };
  EXPECT_FALSE(refused([](State&) {}));
  EXPECT_TRUE(refused([](State& s) { s.particles.x[0] = std::numeric_limits<float>::quiet_NaN(); }));
  EXPECT_TRUE(refused([](State& s) { s.particles.y[0] = 3e38f; })) << "no cell has such a number";
  EXPECT_TRUE(refused([](State& s) { s.particles.vz[0] = -1e30f; }));
  EXPECT_TRUE(refused([](State& s) { s.bubbles.x[0] = std::numeric_limits<float>::infinity(); }));
  EXPECT_TRUE(refused([](State& s) { s.pending[3] = 1e300; }));
  EXPECT_TRUE(refused([](State& s) { s.air = std::numeric_limits<double>::quiet_NaN(); }));
  EXPECT_TRUE(refused([](State& s) { s.particles.age[0] = -1e30f; })) << "its way is counted in cells";
  EXPECT_TRUE(refused([](State& s) { s.particles.volume[0] = -1.0f; }));
  EXPECT_TRUE(refused([](State& s) { s.pools.depth[0] = 1e30f; })) << "waves' steps are counted";
  EXPECT_TRUE(refused([](State& s) { s.emitted = std::numeric_limits<double>::quiet_NaN(); }));
}

TEST(Flood, IsBoundedAnnouncedAndLosesNothing) {
  Fluid f = basin(1, 200);
  f.inputs.suction_count = 0;
  bool degraded = false;
  for (int k = 0; k < 300; ++k) {
    f.step();
    degraded |= f.state.degraded;
    ASSERT_LE(f.state.particles.count, 200U);
  }
  EXPECT_TRUE(degraded);
  EXPECT_LT(std::fabs(f.gap()), 1e-4 * f.state.emitted);
  EXPECT_LT(f.state.lost, 0.01 * f.state.emitted) << "the oldest joined the pool";
}

TEST(Flood, WhatRisesAboveTheBoxRunsOverItsRim) {
  Fluid f = basin(1);
  f.inputs.source_count = f.inputs.suction_count = 0;
  f.step();  // knows its bed
  const Parameters& p = f.model.parameters;
  double poured = 0;
  for (int row = 0; row < f.model.rows; ++row)
    for (int column = 0; column < f.model.columns; ++column)
      if (fillCell(f.model, f.state, column, row, 1e-5, 0.5)) poured += 1e-5;  // 0.6 m deep
  ASSERT_GT(poured, 1e-3);
  for (int k = 0; k < 5; ++k) f.step();
  EXPECT_GT(f.state.lost, 0.3 * poured);
  EXPECT_NEAR(poolVolume(f.model, f.state) + f.state.lost, poured, 1e-5 * poured);
  EXPECT_NEAR(poolBlood(f.model, f.state) / poolVolume(f.model, f.state), 0.5, 1e-3);
  for (std::size_t i = 0; i < f.state.pools.depth.size(); ++i)
    EXPECT_LE(f.state.pools.depth[i], p.high[2] - p.low[2]);
}

TEST(Input, WhatIsNoNumberOrAbsurdIsRefusedAndChangesNothing) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const auto refused = [](auto&& spoil) {
    Fluid f = basin(1);
    for (int k = 0; k < 5; ++k) f.step();
    std::vector<std::uint8_t> before, after;
    save(f.state, before);
    spoil(f.inputs);
    f.step();
    save(f.state, after);
    return f.report.status == Status::BadInput && before == after;
  };
  EXPECT_TRUE(refused([&](Inputs& i) { i.dt = nan; }));
  EXPECT_TRUE(refused([&](Inputs& i) { i.dt = 1; }));
  EXPECT_TRUE(refused([&](Inputs& i) { i.sources[0].flow = -1e-6; }));
  EXPECT_TRUE(refused([&](Inputs& i) { i.sources[0].flow = 1; }));
  EXPECT_TRUE(refused([&](Inputs& i) { i.sources[1].position[2] = nan; }));
  EXPECT_TRUE(refused([&](Inputs& i) { i.sources[1].direction = {0, 0, 0}; }));
  EXPECT_TRUE(refused([&](Inputs& i) { i.sources[1].slot = kMostSources; }));
  EXPECT_TRUE(refused([&](Inputs& i) { i.suctions[0].reach = 10; }));
  EXPECT_TRUE(refused([&](Inputs& i) { i.gravity[0] = nan; }));
}

TEST(Parameters, AreRefusedWithFieldValueAndWhatIsAllowed) {
  const auto message = [](auto&& spoil) {
    Parameters p;
    spoil(p);
    try {
      buildModel(p, {});
    } catch (const std::invalid_argument& e) {
      return std::string(e.what());
    }
    return std::string("accepted");
  };
  EXPECT_EQ(message([](Parameters& p) { p.spacing = 0.1; }),
            "fluid: spacing: 0.1 (allowed: 0.0005 to 0.01 m)");
  EXPECT_EQ(message([](Parameters& p) { p.capacity = 1000000; }),
            "fluid: capacity: 1e+06 (allowed: 16 to 60000 particles)");
  EXPECT_NE(message([](Parameters& p) { p.friction = std::nan(""); }).find("fluid: friction: nan"),
            std::string::npos);
  EXPECT_NE(message([](Parameters& p) { p.high[1] = p.low[1]; }).find("high - low, y"), std::string::npos);
}

TEST(Pool, AirBubblesComeWithAPlungingJetAndGo) {
  Fluid f = basin(1);
  f.inputs.source_count = 1;
  f.inputs.suction_count = 0;
  f.inputs.sources[0].flow = 5e-5;
  std::size_t most = 0;
  for (int k = 0; k < 700; ++k) {
    f.step();
    most = std::max(most, f.state.bubbles.count);
  }
  EXPECT_GT(most, 2U);
  f.inputs.source_count = 0;
  for (int k = 0; k < 1500; ++k) f.step();
  EXPECT_EQ(f.state.bubbles.count, 0U);
}

}  // namespace
}  // namespace vest::fluid::specimen
