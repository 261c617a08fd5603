// Protects what a hand feels in an image: the forces are those of the theory, they begin and end at the
// tissue, and a second insertion cuts nothing.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

#include <Eigen/LU>

#include "blocks.h"

using namespace vest;
using namespace vest::voxel;
using namespace vest::voxel::testing;

namespace {

const auto half_space = [](double z) { return z < 0 ? 100 : 0; };

}  // namespace

TEST(Needle, HalfSpaceTakesYieldAndFrictionOfTheShaft) {
  const auto made = makeFeelable(layers(half_space), table({100, 0.8, 0, 10}, {100, 0.8, 0, 10}), options());
  Hand hand(made->view(), Kind::Needle);
  for (const double depth : {0.010, 0.020, 0.030}) {
    hand.go({0, 0, -depth}, 0.01);
    const double theory = 0.8 + 10 * depth;
    EXPECT_NEAR(hand.felt.force.z(), theory, 0.05 * theory) << depth;
    EXPECT_NEAR(hand.felt.force.head<2>().norm(), 0, 1e-9);
  }
  // Drawn back, the shaft alone holds.
  hand.go({0, 0, -0.024}, 0.01);
  EXPECT_NEAR(hand.felt.force.z(), -10 * 0.024, 0.05 * 0.24);
}

TEST(Needle, ALayerTakesItsYieldOverItsThickness) {
  // 12 mm of 200 within 100: the force rises to the layer's, and falls behind it.
  const auto made = makeFeelable(layers([](double z) {
                                   return z > 0 ? 0 : z > -0.010 || z < -0.022 ? 100 : 200;
                                 }),
                                 table({100, 0.3, 0, 0}, {100, 1.2, 0, 0}), options());
  Hand hand(made->view(), Kind::Needle);
  hand.go({0, 0, -0.005}, 0.01);
  EXPECT_NEAR(hand.felt.force.z(), 0.3, 0.05 * 0.3);
  double work = 0, before = hand.tip.z();
  hand.go({0, 0, -0.016}, 0.01, [&] {
    work += hand.felt.force.z() * (before - hand.tip.z());
    before = hand.tip.z();
  });
  EXPECT_NEAR(hand.felt.force.z(), 1.2, 0.05 * 1.2);
  hand.go({0, 0, -0.030}, 0.01, [&] {
    work += hand.felt.force.z() * (before - hand.tip.z());
    before = hand.tip.z();
  });
  EXPECT_NEAR(hand.felt.force.z(), 0.3, 0.05 * 0.3);
  // All of the spring's work is lost in what yields: 25 mm of the soft, and what the layer adds over 12.
  const double theory = 0.3 * 0.025 + (1.2 - 0.3) * 0.012;
  EXPECT_NEAR(work, theory, 0.05 * theory);
}

TEST(Needle, TheFirstInsertionLessTheSecondIsTheCutting) {
  const auto made = makeFeelable(layers(half_space), table({100, 0.8, 0, 10}, {100, 0.8, 0, 10}), options());
  Hand hand(made->view(), Kind::Needle);
  hand.go({0, 0, -0.025}, 0.01);
  hand.go({0, 0, -0.005}, 0.01);
  hand.go({0, 0, -0.020}, 0.01);
  EXPECT_NEAR(hand.felt.force.z(), 10 * 0.020, 0.05 * 0.2) << "the channel is there";
  hand.go({0, 0, -0.030}, 0.01);
  EXPECT_NEAR(hand.felt.force.z(), 0.8 + 10 * 0.030, 0.05 * 1.1) << "beyond it, it cuts again";
  // Beside it, too.
  hand.go({0, 0, 0.005}, 0.01);
  hand.go({0.005, 0, 0.005}, 0.01);
  hand.go({0.005, 0, -0.010}, 0.01);
  EXPECT_NEAR(hand.felt.force.z(), 0.8 + 10 * 0.010, 0.05 * 0.9);
}

TEST(Needle, ACapsuleHoldsAndDropsOverTwentyMilliseconds) {
  auto o = options();
  // Thinner than the needle's point moves before it gives way.
  o.region = [](const Vector3d& p, double) {
    return static_cast<std::uint8_t>(p.z() < -0.005 && p.z() > -0.007 ? 1 : 0);
  };
  o.capsules = {1.5};
  const auto made = makeFeelable(layers(half_space), table({100, 0.4, 0, 0}, {100, 0.4, 0, 0}), o);
  Hand hand(made->view(), Kind::Needle);
  double most = 0, broke = 0;
  int entered = 0, dropping = 0;
  hand.go({0, 0, -0.015}, 0.01, [&] {
    most = std::max(most, hand.felt.force.z());
    broke = std::max(broke, hand.felt.broke);
    entered += hand.felt.entered == 1;
    dropping += broke > 0 && hand.felt.force.z() > 0.45;
  });
  EXPECT_EQ(entered, 1);
  EXPECT_EQ(broke, 1.5);
  EXPECT_NEAR(most, 1.5, 0.05 * 1.5);
  EXPECT_GE(dropping, 14) << "1.05 N of 1.5 in 20 ms";
  EXPECT_NEAR(hand.felt.force.z(), 0.4, 0.05 * 0.4);
  EXPECT_LE(hand.jump, 0.05 * kFull);
  // Through the hole that is there it goes without one.
  hand.go({0, 0, -0.002}, 0.01);
  broke = most = 0;
  hand.go({0, 0, -0.012}, 0.01, [&] {
    most = std::max(most, hand.felt.force.z());
    broke = std::max(broke, hand.felt.broke);
  });
  EXPECT_EQ(broke, 0.0);
  EXPECT_LT(most, 0.05);
}

TEST(Needle, APointBeyondTheFrameIsFeltThereAndActsByItsLever) {
  const auto made = makeFeelable(layers(half_space), table({100, 0.8, 0, 0}, {100, 0.8, 0, 0}), options());
  const auto press = [&](double reach) {
    ToolState state;
    Motion m;
    m.kind = Kind::Needle, m.pivot = {0, 0, 0.13 + reach}, m.reach = reach;
    Felt felt;
    for (int i = 0; i <= 4000; ++i) {
      const Vector3d point(0, 0, 0.01 - 5e-6 * std::min(i, 3000)), along = (point - m.pivot).normalized();
      m.tip = point - reach * along;
      felt = step(made->view(), m, state);
    }
    // A short way aside.
    m.tip += Vector3d(2e-4, 0, 0);
    return std::make_pair(felt, step(made->view(), m, state));
  };
  const auto [straight, aside] = press(0.02);
  EXPECT_NEAR(straight.tip.z(), -0.005, 1e-9);
  EXPECT_NEAR(straight.force.z(), 0.8, 0.04);
  const double length = 0.13 + 0.02 + 0.005 - 0.02, lever = (length + 0.02) / length;
  // The point goes further aside than the frame, and so does its force: by the lever twice.
  EXPECT_NEAR(aside.force.x(), -500 * 2e-4 * lever * lever, 0.1 * 500 * 2e-4);
}

TEST(Probe, HalfSpaceGivesWayAsTheoryOfAFlatPunchHasIt) {
  const double youngs_modulus = 20e3, k = 2 * volume::kProbeRadius * youngs_modulus / (1 - 0.25);
  const auto made = makeFeelable(layers(half_space), table({k, 0.5, 0, 0}, {k, 0.5, 0, 0}), options());
  Hand hand(made->view(), Kind::Probe);
  for (const double depth : {0.001, 0.003, 0.006}) {
    hand.go({0, 0, -depth}, 0.01);
    EXPECT_NEAR(hand.felt.force.z(), k * depth, 0.05 * k * depth + 0.05 * k * 1e-4) << depth;
    hand.go({0.010, 0, -depth}, 0.01);
    EXPECT_NEAR(hand.felt.force.x(), -0.1 * hand.felt.force.z(), 0.01 * k * depth)
        << "it slides with friction";
  }
  hand.go({0, 0, 0.002}, 0.01);
  EXPECT_EQ(hand.felt.force.norm(), 0.0);
}

/// Stiffness under a flat rigid punch of a layer that is bonded to a half-space, both incompressible, over
/// that of a half-space of the layer alone. What the surface gives way under a wave of pressure is that of
/// Burmister's layers (J. Applied Physics 16, 1945); the pressure follows from an integral equation in the
/// way of Copson.
double layerUnderPunch(double layer_over_ground, double thickness_over_radius) {
  const double l = (layer_over_ground - 1) / (layer_over_ground + 1), x = thickness_over_radius;
  constexpr int kPoints = 60, kWaves = 2000;
  Eigen::MatrixXd equation = Eigen::MatrixXd::Identity(kPoints, kPoints);
  for (int w = 0; w < kWaves; ++w) {
    const double step = 25.0 / x / kWaves, k = (w + 0.5) * step, s = k * x, e = std::exp(-2 * s);
    const double gives =
        (1 + 4 * l * s * e - l * l * e * e) / (1 - (2 * l + 4 * l * s * s) * e + l * l * e * e);
    Eigen::VectorXd wave(kPoints);
    for (int i = 0; i < kPoints; ++i) wave[i] = std::cos(k * (i + 0.5) / kPoints);
    equation += 2 / M_PI * (gives - 1) * step / kPoints * wave * wave.transpose();
  }
  return equation.partialPivLu().solve(Eigen::VectorXd::Ones(kPoints)).mean();
}

TEST(Probe, ALayerGivesWayAsTheoryOfElasticityHasIt) {
  EXPECT_NEAR(layerUnderPunch(1, 1), 1, 1e-9);
  EXPECT_NEAR(layerUnderPunch(0.25, 100), 1, 0.02) << "nothing but the layer is felt";
  // Of nearly equal moduli each counts by its share of what the punch strains (Gao, Chiu, Lee 1992).
  const double share = 2 / M_PI * std::atan(1.5) - 1.5 / (M_PI * (1 + 1.5 * 1.5));
  EXPECT_NEAR(layerUnderPunch(0.98, 1.5), 1 + (1 - share) * (1 / 0.98 - 1), 3e-4);
  for (const auto& [upper, lower] :
       {std::pair{100.0, 200.0}, {100.0, 400.0}, {200.0, 100.0}, {400.0, 100.0}, {100.0, 100.0}})
    for (const double thick : {0.003, 0.006}) {
      // The value rises inwards; the table says what it means.
      const auto made = makeFeelable(layers([&](double z) { return z > 0        ? 0
                                                                   : z > -thick ? 100
                                                                                : 200; }),
                                     table({upper, 1, 0, 0}, {lower, 1, 0, 0}), options());
      Hand hand(made->view(), Kind::Probe);
      hand.go({0, 0, -0.001}, 0.01);
      const double theory = upper * layerUnderPunch(upper / lower, thick / volume::kProbeRadius);
      EXPECT_NEAR(hand.felt.stiffness, theory, 0.05 * theory) << upper << " on " << lower << ", " << thick;
    }
}

TEST(Probe, WhatHasNoStiffnessBelowALayerTakesNotAllOfIt) {
  const auto made = makeFeelable(layers([&](double z) { return z > 0        ? 0
                                                               : z > -0.010 ? 100
                                                                            : 200; }),
                                 table({100, 1, 0, 0}, {0, 1, 0, 0}), options());
  Hand hand(made->view(), Kind::Probe);
  hand.go({0, 0, -0.001}, 0.01);
  EXPECT_GT(hand.felt.stiffness, 40);
  EXPECT_LT(hand.felt.stiffness, 90);
}
TEST(Zero, InAirPaddingAndOutside) {
  const auto made = makeFeelable(layers([](double z) {
                                   return z > 0 ? 0 : z < -0.02 ? volume::Brick::kNothing : 100;
                                 }),
                                 table({100, 0.8, 0.5, 10}, {100, 0.8, 0.5, 10}), options());
  for (const Kind kind : {Kind::Needle, Kind::Probe}) {
    Hand hand(made->view(), kind);
    hand.pivot = {0, 0, 0.02};  // no shaft in tissue
    for (const Vector3d& to :
         {Vector3d(0.01, 0, 0.004), Vector3d(-0.02, 0.01, 0.01), Vector3d(0.1, 0, 0.01)}) {
      hand.go(to, 0.05, [&] { EXPECT_EQ(hand.felt.force.norm(), 0.0) << hand.tip.transpose(); });
    }
  }
  // Where nothing was measured nothing holds the tip, from the nearest voxel on.
  Hand hand(made->view(), Kind::Needle);
  bool felt = false;
  hand.pivot = {0, 0, 1};
  hand.go({0, 0, -0.035}, 0.02, [&] {
    if (hand.tip.z() < -0.0201) {
      EXPECT_LT(sampleValue(made->view(), hand.tip).share, 1e-12) << hand.tip.z();
    }
    felt |= hand.felt.force.z() > 0.7;
  });
  EXPECT_TRUE(felt);
  EXPECT_EQ(sampleValue(made->view(), {NAN, 0, 0}).share, 0.0);
  EXPECT_EQ(regionAt(made->view(), {NAN, 0, 0}), 0);
}

TEST(Bits, TheSameMotionGivesTheSameBits) {
  const auto made = lumbar(volume::readTransferTable(VEST_TISSUE_SCENES "/spine_puncture/needle.csv"), 10);
  const auto again = lumbar(volume::readTransferTable(VEST_TISSUE_SCENES "/spine_puncture/needle.csv"), 10);
  ASSERT_EQ(made->stored, again->stored);
  for (const Kind kind : {Kind::Needle, Kind::Probe}) {
    Hand a(made->view(), kind), b(again->view(), kind);
    for (Hand* hand : {&a, &b}) {
      hand->pivot = {0.02, 0, 0.2};
      hand->state = {};
      hand->to({0, -0.015, 0.12});
      hand->go({0.01, -0.02, 0.06}, 0.05);
      hand->go({0.012, -0.018, 0.055}, 0.05);
    }
    EXPECT_GT(a.felt.force.norm(), 0.0);
    EXPECT_EQ(std::memcmp(&a.felt.force, &b.felt.force, sizeof a.felt.force), 0);
    EXPECT_EQ(std::memcmp(&a.state.spring, &b.state.spring, sizeof a.state.spring), 0);
  }
}
