// Openings of vessels: cut, clipped, tied and sealed; loss by wound and vessel.

#include <gtest/gtest.h>

#include <cmath>

#include "vest_effects/bleeding/wounds.h"

using namespace vest::bleeding;
namespace hd = vest::haemodynamics;

namespace {

const hd::Circulation& pelvis() {
  static const hd::Circulation built =
      hd::buildCirculation(hd::readVessels(VEST_VESSEL_DATA "/pelvis"), 0.006);
  return built;
}

struct Patient {
  const Vessels& vessels = pelvis().model;
  hd::CirculationState state = pelvis().rest;
  hd::CirculationInputs inputs;
  hd::CirculationScratch scratch{pelvis().model};
  WoundState wounds;
  int artery = pelvis().model.find("uterine_artery_left");
  int vein = pelvis().model.find("uterine_vein_left");
  /// ml lost in so many seconds.
  double seconds(double t) {
    const double before = state.lost;
    for (int i = 0; i < static_cast<int>(t * 1000 + 0.5); ++i) {
      fill(vessels, wounds, inputs);
      EXPECT_EQ(step(vessels, inputs, 1e-3, state, scratch), hd::Status::kOk);
      book(state, 1e-3, wounds);
    }
    return 1e6 * (state.lost - before);
  }
  double pressure(double station) const { return at(vessels, state, artery, station).pressure; }
};

}  // namespace

TEST(Wounds, CutThroughArteryBleedsFromBothStumpsAndThePressureBehindFalls) {
  Patient p;
  ASSERT_TRUE(open(p.vessels, p.artery, 0.08, 2e-6, {}, p.wounds));  // wider than the lumen of 1.5 mm²
  ASSERT_EQ(p.wounds.opening_count, 2);
  EXPECT_EQ(p.wounds.openings[0].end, End::kHeart);
  EXPECT_EQ(p.wounds.openings[1].end, End::kFar);
  EXPECT_NE(p.wounds.openings[0].slot, p.wounds.openings[1].slot);
  const double before = p.pressure(0.12);
  const double lost = p.seconds(3);
  std::printf("cut uterine artery: %.2f ml in 3 s, heart's stump %.2f, far stump %.2f\n", lost,
              1e6 * p.wounds.openings[0].lost, 1e6 * p.wounds.openings[1].lost);
  EXPECT_GT(p.wounds.openings[0].lost, p.wounds.openings[1].lost);
  EXPECT_GT(p.wounds.openings[1].lost, 0);  // by the ovarian artery's branch
  EXPECT_LT(p.pressure(0.12), 0.6 * before);
  EXPECT_NEAR(lost, 1e6 * (p.wounds.openings[0].lost + p.wounds.openings[1].lost), 1e-9);
}

TEST(Wounds, AClipOneMillimetreFromTheStumpStopsItWhateverTheCellsAre) {
  for (const double distance : {0.001, 0.004, 0.02}) {
    Patient p;
    ASSERT_TRUE(open(p.vessels, p.artery, 0.08, 2e-6, {}, p.wounds));
    p.seconds(0.5);
    ASSERT_TRUE(clamp(p.vessels, ClampKind::kClip, p.artery, 0.08 - distance, 0, p.wounds));
    p.seconds(1.5);  // what lies between clip and stump runs out
    const double heart = p.wounds.openings[0].lost, far = p.wounds.openings[1].lost;
    p.seconds(1);
    EXPECT_LT(p.wounds.openings[0].lost - heart, 2e-9) << distance;
    EXPECT_GT(p.wounds.openings[1].lost - far, 1e-9) << distance;
    ASSERT_TRUE(clamp(p.vessels, ClampKind::kLigature, p.artery, 0.08 + distance, 0, p.wounds));
    p.seconds(1.5);
    EXPECT_LT(p.seconds(1), 4e-3) << distance;
    ASSERT_TRUE(release(p.artery, 0.08 - distance, p.wounds));
    EXPECT_GT(p.seconds(1), 0.1) << distance;
    EXPECT_FALSE(release(p.artery, 0.08 - distance, p.wounds));
  }
}

TEST(Wounds, CoagulationSealsAPunctureByItsAreaAndThenTheVessel) {
  Patient p;
  ASSERT_TRUE(open(p.vessels, p.artery, 0.05, 3e-7, {}, p.wounds));
  ASSERT_TRUE(open(p.vessels, p.artery, 0.051, 2e-7, {}, p.wounds));
  ASSERT_EQ(p.wounds.opening_count, 1);  // one place
  EXPECT_NEAR(p.wounds.openings[0].area, 5e-7, 1e-15);
  const double open_loss = p.seconds(1);
  ASSERT_TRUE(seal(p.vessels, p.artery, 0.052, 2.5e-7, true, p.wounds));
  p.seconds(0.2);
  const double half = p.seconds(1);
  EXPECT_LT(half, 0.8 * open_loss);
  EXPECT_GT(half, 0.2 * open_loss);
  ASSERT_TRUE(seal(p.vessels, p.artery, 0.052, 2.5e-7, true, p.wounds));
  p.seconds(0.2);
  EXPECT_EQ(p.seconds(1), 0);
  EXPECT_EQ(closure(p.artery, p.wounds), 0);
  ASSERT_TRUE(seal(p.vessels, p.artery, 0.052, 1e-5, false, p.wounds));  // too little heat for the lumen
  EXPECT_EQ(closure(p.artery, p.wounds), 0);
  ASSERT_TRUE(seal(p.vessels, p.artery, 0.052, 1e-5, true, p.wounds));
  EXPECT_EQ(closure(p.artery, p.wounds), 1);
}

TEST(Wounds, VeinOozesFromBothStumpsUntilBothAreClosed) {
  Patient p;
  ASSERT_TRUE(open(p.vessels, p.vein, 0.05, 1e-4, {}, p.wounds));
  ASSERT_EQ(p.wounds.opening_count, 2);
  const double both = p.seconds(1);
  std::printf("cut uterine vein: %.2f ml/s\n", both);
  EXPECT_GT(both, 0.05);
  ASSERT_TRUE(clamp(p.vessels, ClampKind::kClip, p.vein, 0.06, 0, p.wounds));
  const double heart = p.seconds(1);
  EXPECT_LT(heart, both);
  EXPECT_GT(heart, 0);
  ASSERT_TRUE(seal(p.vessels, p.vein, 0.05, 1e-3, true, p.wounds));
  EXPECT_EQ(p.seconds(1), 0);
}

TEST(Wounds, RoomIsBoundedAndWhatDoesNotFitIsCounted) {
  Patient p;
  for (int i = 0; i < 200; ++i) {
    open(p.vessels, i % p.vessels.vesselCount(), 0.001 + 0.0065 * (i / p.vessels.vesselCount()), 1e-7, {},
         p.wounds);
    clamp(p.vessels, ClampKind::kClip, p.artery, 0.0007 * i, 0.5, p.wounds);
  }
  EXPECT_EQ(p.wounds.opening_count, kMostOpenings);
  EXPECT_EQ(p.wounds.clamp_count, kMostClamps);
  EXPECT_GT(p.wounds.refused, 0U);
  EXPECT_FALSE(open(p.vessels, p.artery, -1, 1e-7, {}, p.wounds));
  EXPECT_FALSE(open(p.vessels, 10000, 0, 1e-7, {}, p.wounds));
  EXPECT_FALSE(open(p.vessels, p.artery, 0.01, std::nan(""), {}, p.wounds));
  p.seconds(0.2);
}
