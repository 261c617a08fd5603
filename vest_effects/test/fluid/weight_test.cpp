#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <map>

#include "boxes.h"

// Protects the weight of pools on what yields: no gram more or less than stands there, pressure along the
// normal, Archimedes' lift for what dips in, by the level of the liquid that is there, none for a sheet with
// water on both sides, nothing from tissue that went away, the same bits for any threads.

namespace vest::fluid::specimen {
namespace {

constexpr double kGravity = 9.81, kWater = 1000;  // m/s², kg/m³

/// A bowl z = steepness·r², a sheet that faces up.
Mesh bowl(double half, double steepness, int cells) {
  Mesh m = plate(half, 0.0, cells);
  for (std::size_t k = 0; k < m.positions.size(); k += 3)
    m.positions[k + 2] =
        static_cast<float>(steepness * (std::pow(m.positions[k], 2) + std::pow(m.positions[k + 1], 2)));
  return m;
}

/// A closed block on or over the floor.
Mesh block(double half, double low, double high, int cells) {
  Mesh m;
  const double s = 2 * half, h = high - low;
  m.add({-half, -half, high}, {s, 0, 0}, {0, s, 0}, cells);
  m.add({-half, -half, low}, {0, s, 0}, {s, 0, 0}, cells);
  m.add({-half, -half, low}, {s, 0, 0}, {0, 0, h}, cells);
  m.add({half, half, low}, {-s, 0, 0}, {0, 0, h}, cells);
  m.add({half, -half, low}, {0, s, 0}, {0, 0, h}, cells);
  m.add({-half, half, low}, {0, -s, 0}, {0, 0, h}, cells);
  return m;
}

struct Pool : Fluid {
  std::vector<std::array<bool, 2>> kind;  ///< per mesh: rigid, closed
  Pool(std::vector<Mesh> meshes, std::vector<std::array<bool, 2>> of, int threads = 1)
      : Fluid(Parameters{}, std::move(meshes), threads), kind(std::move(of)) {}

  /// A step that looks at the ground and the weight.
  void weigh() {
    surfaces.clear();
    for (std::size_t k = 0; k < meshes.size(); ++k) {
      surfaces.push_back(meshes[k].surface());
      surfaces.back().rigid = kind[k][0], surfaces.back().closed = kind[k][1];
    }
    inputs.surfaces = surfaces.data(), inputs.surface_count = surfaces.size();
    inputs.renew_bed = true;
    fluid::step(model, inputs, state, scratch, report);
  }
  std::array<double, 3> force(std::uint16_t surface) const {
    std::array<double, 3> sum{};
    for (const KnotLoad& l : report.loads)
      if (l.surface == surface)
        for (std::size_t a = 0; a < 3; ++a) sum[a] += static_cast<double>(l.force[a]);
    return sum;
  }
  /// To a level (m) wherever the bed lies lower.
  void fillTo(double level, double blood = 0) {
    const double area = std::pow(model.parameters.pool_cell, 2);
    for (int r = 0; r < model.rows; ++r) {
      for (int c = 0; c < model.columns; ++c) {
        const auto i = static_cast<std::size_t>(r) * static_cast<std::size_t>(model.columns) +
                       static_cast<std::size_t>(c);
        const double top = static_cast<double>(state.pools.bed[i] + state.pools.depth[i]);
        if (top > -1 && top < level) fillCell(model, state, c, r, (level - top) * area, blood);
      }
    }
  }
};

TEST(Weight, WhatStandsInASoftBowlWeighsOnItGramForGram) {
  Pool p({bowl(0.06, 5.0, 24)}, {{false, false}});
  p.weigh();
  EXPECT_TRUE(p.report.loads.empty()) << "dry";
  p.fillTo(0.008);
  p.weigh();
  const double volume = poolVolume(p.model, p.state);
  ASSERT_GT(volume, 1e-6);
  const auto f = p.force(0);
  EXPECT_NEAR(f[2], -kWater * kGravity * volume, 1e-5 * kWater * kGravity * volume);
  EXPECT_NEAR(f[0], 0, 0.01 * std::fabs(f[2]))
      << "its walls hold each other; triangles of 5 mm, cells of 4 mm";
  // On one half the walls push outwards by the pressure on their upright projection.
  double outwards = 0, upright = 0;
  for (const KnotLoad& l : p.report.loads)
    if (p.meshes[0].positions[3 * l.knot] > 0) outwards += static_cast<double>(l.force[0]);
  for (double y = -0.05; y < 0.05; y += 1e-4)
    upright += 0.5 * kWater * kGravity * std::pow(std::max(0.0, 0.008 - 5 * y * y), 2) * 1e-4;
  EXPECT_NEAR(outwards, upright, 0.05 * upright) << "cells of 4 mm";
}

TEST(Weight, BloodWeighsMore) {
  Pool p({bowl(0.06, 5.0, 24)}, {{false, false}});
  p.weigh();
  p.fillTo(0.008, 1.0);
  p.weigh();
  const double weight = 1060 * kGravity * poolVolume(p.model, p.state);
  EXPECT_NEAR(p.force(0)[2], -weight, 1e-5 * weight);
}

TEST(Weight, RigidGroundIsNotTold) {
  Pool p({bowl(0.06, 5.0, 24)}, {{true, false}});
  p.weigh();
  p.fillTo(0.008);
  p.weigh();
  EXPECT_TRUE(p.report.loads.empty());
}

TEST(Weight, WhatDipsInIsLiftedByTheWaterItDisplaces) {
  // 24 × 24 × 8 mm, 2 mm over the ground of a basin.
  const double half = 0.012, low = 0.002, high = 0.010;
  Pool p({openBox(-0.06, 0.06, -0.06, 0.06, 0.04, 12), block(half, low, high, 6)},
         {{true, false}, {false, true}});
  p.weigh();
  p.fillTo(0.006);
  p.weigh();
  const double half_deep = kWater * kGravity * 4 * half * half * 0.004;
  EXPECT_NEAR(p.force(1)[2], half_deep, 0.03 * half_deep) << "half of it";
  p.fillTo(0.016);  // over its top, too
  p.weigh();
  const double all = kWater * kGravity * 4 * half * half * (high - low);
  EXPECT_NEAR(p.force(1)[2], all, 0.03 * all) << "the water upon it weighs, that below it lifts more";
  EXPECT_NEAR(p.force(1)[0], 0, 0.01 * all);
}

TEST(Weight, WhatIsNarrowerThanACellIsNotPushedAside) {
  // A bar of 24 × 3 × 3 mm on an edge, as a vessel in a pool, at eight places within a cell.
  const double half = 0.012, thin = 0.0015, turn = 0.5;
  const double all = kWater * kGravity * 8 * half * thin * thin;
  for (int place = 0; place < 8; ++place) {
    Mesh bar = block(half, -thin, thin, 6);
    for (std::size_t k = 0; k < bar.positions.size(); k += 3) {
      const double y = bar.positions[k + 1] * thin / half, z = bar.positions[k + 2];
      bar.positions[k + 1] = static_cast<float>(std::cos(turn) * y - std::sin(turn) * z + 0.0005 * place);
      bar.positions[k + 2] = static_cast<float>(std::sin(turn) * y + std::cos(turn) * z + 0.005);
    }
    Pool p({openBox(-0.06, 0.06, -0.06, 0.06, 0.04, 12), bar}, {{true, false}, {false, true}});
    p.weigh();
    p.fillTo(0.012);
    p.weigh();
    p.fillTo(0.012);
    p.weigh();
    for (const std::size_t axis : {0, 1}) EXPECT_NEAR(p.force(1)[axis], 0, 0.03 * all) << place;
  }
}

/// Greatest change of a load (N) from one look to the next, of any knot.
double greatestChange(const std::vector<KnotLoad>& before, const std::vector<KnotLoad>& now) {
  std::map<std::uint32_t, double> change;
  for (const KnotLoad& l : before) change[l.knot] -= static_cast<double>(l.force[2]);
  for (const KnotLoad& l : now) change[l.knot] += static_cast<double>(l.force[2]);
  double most = 0;
  for (const auto& [knot, by] : change) most = std::max(most, std::fabs(by));
  return most;
}

TEST(Weight, AVesselIsLiftedAlikeWhereverItLiesAmongTheCells) {
  // A bar as a vessel of 3 mm; in steps of 0.1 mm across two cells of 4 mm.
  const double half = 0.012, thin = 0.0015, volume = 8 * half * thin * thin;
  const double all = kWater * kGravity * volume;
  std::vector<KnotLoad> before;
  double most = 0, greatest = 0;
  for (int place = 0; place <= 80; ++place) {
    Mesh bar = block(half, -thin, thin, 6);
    for (std::size_t k = 0; k < bar.positions.size(); k += 3)
      bar.positions[k + 1] = static_cast<float>(bar.positions[k + 1] * thin / half + 1e-4 * place),
                        bar.positions[k + 2] += 0.005f;
    Pool p({openBox(-0.06, 0.06, -0.06, 0.06, 0.04, 12), bar}, {{true, false}, {false, true}});
    for (int look = 0; look < 2; ++look) p.weigh(), p.fillTo(0.012);
    p.weigh();
    EXPECT_NEAR(p.force(1)[2], all, 0.02 * all) << place << ": Archimedes";
    for (const KnotLoad& l : p.report.loads)
      greatest = std::max(greatest, std::fabs(static_cast<double>(l.force[2])));
    if (place > 0) most = std::max(most, greatestChange(before, p.report.loads));
    before = p.report.loads;
  }
  EXPECT_LT(most, 0.05 * greatest) << "N: no knot's load comes and goes with a cell's middle";
}

TEST(Weight, ASheetThatDipsInLosesItsLoadSmoothly) {
  // 2 mm of water on a sheet that sinks into 6 mm of it, in steps of 0.1 mm.
  Mesh sheet;
  sheet.add({-0.02, -0.02, 0}, {0.04, 0, 0}, {0, 0.04, 0}, 10);
  Pool p({openBox(-0.06, 0.06, -0.06, 0.06, 0.04, 12), sheet}, {{true, false}, {false, false}});
  const auto to = [&](double z) {
    for (std::size_t k = 2; k < p.meshes[1].positions.size(); k += 3)
      p.meshes[1].positions[k] = static_cast<float>(z);
  };
  to(0.008);
  p.weigh();
  p.fillTo(0.006);
  for (int r = p.model.rows / 2 - 5; r < p.model.rows / 2 + 5; ++r)
    for (int c = p.model.columns / 2 - 5; c < p.model.columns / 2 + 5; ++c)
      ASSERT_TRUE(fillCell(p.model, p.state, c, r, 0.002 * 0.004 * 0.004, 0));
  const State poured = p.state;
  std::vector<double> loads;
  for (int step = 0; step <= 50; ++step) {
    p.state = poured;
    to(0.008 - 1e-4 * step);
    p.weigh();
    loads.push_back(-p.force(1)[2]);
  }
  const double all = kWater * kGravity * 0.04 * 0.04 * 0.002;
  EXPECT_NEAR(loads.front(), all, 1e-3 * all);
  EXPECT_NEAR(loads.back(), 0, 1e-3 * all) << "water on both sides";
  for (std::size_t k = 1; k < loads.size(); ++k) EXPECT_NEAR(loads[k], loads[k - 1], 0.06 * all) << k;
}

/// A block of 40 mm, 2 mm over the ground of a basin of 56 mm (whole cells): there is little water beside it.
struct Narrow : Pool {
  static constexpr double kLow = 0.002, kBlock = 0.04 * 0.04, kBeside = 0.056 * 0.056 - kBlock;  // m, m²
  Narrow()
      : Pool({openBox(-0.028, 0.028, -0.028, 0.028, 0.04, 14), block(0.02, kLow, 0.02, 10)},
             {{true, false}, {false, true}}) {
    weigh();
  }
  /// N: what the level lifts at which the liquid that is there stands beside the block and under it
  double archimedes() const {
    const double all = poolVolume(model, state);
    return kWater * kGravity * kBlock * std::max(0.0, (all - kLow * kBlock) / kBeside - kLow);
  }
};

TEST(Weight, LittleWaterLiftsNoMoreThanItsOwnLevel) {
  Narrow p;
  p.fillTo(0.006);
  const double before = poolVolume(p.model, p.state);
  p.weigh();
  const double lift = p.archimedes();
  ASSERT_GT(lift, 0.4 * kWater * kGravity * Narrow::kBlock * 0.004) << "half of what 6 mm would lift";
  EXPECT_NEAR(p.force(1)[2], lift, 0.03 * lift);
  EXPECT_NEAR(poolVolume(p.model, p.state), before, 1e-6 * before) << "nothing is taken";
}

TEST(Weight, WhatDoesNotFillTheGapLiftsNothing) {
  Narrow p;
  p.fillTo(0.0025);
  p.weigh();
  EXPECT_EQ(p.archimedes(), 0) << "half of the gap's height";
  EXPECT_EQ(p.force(1)[2], 0);
}

TEST(Weight, AnOrganUnderLittleWaterIsLiftedByWhatItDisplaces) {
  Narrow p;
  p.fillTo(0.025);
  p.weigh();
  const double lift = kWater * kGravity * Narrow::kBlock * (0.02 - Narrow::kLow);
  EXPECT_NEAR(p.force(1)[2], lift, 0.03 * lift) << "what runs under it is missing above it, too";
}

TEST(Weight, AGapThatOpensFillsSlowly) {
  Narrow p;
  p.fillTo(0.006);
  p.weigh();
  const double before = p.force(1)[2];
  const double rise = 0.0005;
  for (std::size_t k = 2; k < p.meshes[1].positions.size(); k += 3)
    p.meshes[1].positions[k] += static_cast<float>(rise);
  p.weigh();
  // Less by what it dips in less deep, not by what would have to run under it in 4 ms.
  const double stiff = kWater * kGravity * Narrow::kBlock * rise;
  EXPECT_NEAR(p.force(1)[2], before - stiff, 0.05 * stiff);
  for (int look = 0; look < 20; ++look) {  // s
    p.inputs.renew_bed = false;
    for (int n = 0; n < 250; ++n) fluid::step(p.model, p.inputs, p.state, p.scratch, p.report);
    p.weigh();
  }
  const double low = Narrow::kLow + rise, all = poolVolume(p.model, p.state),
               lift = kWater * kGravity * Narrow::kBlock *
                      ((all - low * Narrow::kBlock) / Narrow::kBeside - low);
  EXPECT_NEAR(p.force(1)[2], lift, 0.05 * lift) << "20 s later";
}

TEST(Weight, ASheetWithWaterOnBothSidesIsLeftAlone) {
  Mesh sheet;
  sheet.add({-0.02, -0.02, 0.004}, {0.04, 0, 0}, {0, 0.04, 0}, 10);
  Pool p({openBox(-0.06, 0.06, -0.06, 0.06, 0.04, 12), sheet}, {{true, false}, {false, false}});
  p.weigh();
  p.fillTo(0.010);
  p.weigh();
  EXPECT_TRUE(p.report.loads.empty());
}

TEST(Weight, WhatPassesOverAPoolDoesNotTakeItAlong) {
  // A block 20 mm over a pool of 4 mm, as a cut vessel that swings over blood.
  Pool p({openBox(-0.06, 0.06, -0.06, 0.06, 0.04, 12), block(0.008, 0.024, 0.030, 4)},
         {{true, false}, {false, true}});
  const auto to = [&](double x) {
    for (std::size_t k = 0; k < p.meshes[1].positions.size(); k += 3)
      p.meshes[1].positions[k] += static_cast<float>(x);
  };
  to(-0.04);
  p.weigh();
  p.fillTo(0.004);
  p.weigh();
  const double before = poolVolume(p.model, p.state);
  for (int look = 0; look < 8; ++look) {
    to(0.01);
    p.weigh();
    for (const KnotLoad& l : p.report.loads) EXPECT_EQ(l.surface, 0) << "nothing stands on the block";
    p.inputs.renew_bed = false;
    for (int n = 0; n < 11; ++n) fluid::step(p.model, p.inputs, p.state, p.scratch, p.report);
    EXPECT_NEAR(poolVolume(p.model, p.state), before, 1e-5 * before);
    double most = 0;
    for (std::size_t i = 0; i < p.state.pools.depth.size(); ++i)
      most = std::max(most, static_cast<double>(p.state.pools.depth[i]));
    EXPECT_LT(most, 0.012) << "what is set aside is shared out";
  }
}

TEST(Weight, ALiftTellsHowItFollows) {
  const double half = 0.012, low = 0.002, high = 0.010;
  Pool p({openBox(-0.06, 0.06, -0.06, 0.06, 0.04, 12), block(half, low, high, 6)},
         {{true, false}, {false, true}});
  p.weigh();
  p.fillTo(0.006);
  p.weigh();
  double stiffness = 0;
  for (const KnotLoad& l : p.report.loads) {
    if (l.surface != 1) continue;
    stiffness += static_cast<double>(l.stiffness);
    const double z = static_cast<double>(p.meshes[1].positions[3 * l.knot + 2]);
    if (l.stiffness != 0) {
      EXPECT_NEAR(static_cast<double>(l.depth), 0.006 - z, 1e-4) << "m";
    }
  }
  const double waterline = kWater * kGravity * 4 * half * half;
  EXPECT_NEAR(stiffness, waterline, 0.03 * waterline) << "N/m: rho g times the area at the water's level";
}

TEST(Weight, APuddleOnAnOrganThatStandsDryWeighsOnIt) {
  Pool p({openBox(-0.06, 0.06, -0.06, 0.06, 0.04, 12), block(0.02, 0.002, 0.015, 8)},
         {{true, false}, {false, true}});
  p.weigh();
  const int column = p.model.columns / 2, row = p.model.rows / 2;
  ASSERT_TRUE(fillCell(p.model, p.state, column, row, 2e-8, 0));
  p.weigh();
  EXPECT_NEAR(p.force(1)[2], -kWater * kGravity * 2e-8, 1e-3 * kWater * kGravity * 2e-8);
}

TEST(Weight, TissueThatWentAwayBearsNothing) {
  Pool p({bowl(0.06, 5.0, 24)}, {{false, false}});
  p.weigh();
  p.fillTo(0.008);
  for (std::size_t k = 0; k < p.meshes[0].positions.size(); k += 3) p.meshes[0].positions[k] += 0.5f;
  p.weigh();
  EXPECT_TRUE(p.report.loads.empty());
}

TEST(Weight, SameBitsForAnyThreadsAndNothingBetweenTwoLooks) {
  Pool a({bowl(0.06, 5.0, 24)}, {{false, false}}, 1), b({bowl(0.06, 5.0, 24)}, {{false, false}}, 3);
  for (Pool* p : {&a, &b}) p->weigh(), p->fillTo(0.008), p->weigh();
  ASSERT_EQ(a.report.loads.size(), b.report.loads.size());
  for (std::size_t i = 0; i < a.report.loads.size(); ++i) {
    EXPECT_EQ(a.report.loads[i].knot, b.report.loads[i].knot);
    EXPECT_EQ(a.report.loads[i].force, b.report.loads[i].force);
  }
  a.inputs.renew_bed = false;
  fluid::step(a.model, a.inputs, a.state, a.scratch, a.report);
  EXPECT_TRUE(a.report.loads.empty());
}

}  // namespace
}  // namespace vest::fluid::specimen
