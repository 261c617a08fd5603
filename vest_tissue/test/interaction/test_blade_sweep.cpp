#include <gtest/gtest.h>

#include <cmath>

#include "vest_tissue/interaction/blade_sweep.h"

// Protects cuts from gaps between steps: however the way is divided, each edge that passes the blade is found
// once.

namespace vest::interaction {
namespace {

using Eigen::Vector3d;

/// A blade that goes through a segment, which turns about its middle meanwhile. `t` from 0 to 1.
std::array<Vector3d, 2> bladeAt(double t) {
  return {Vector3d(-0.01, 0.004 * t - 0.002, 0.0), Vector3d(0.01, 0.004 * t - 0.002, 0.001 * t)};
}
std::array<Vector3d, 2> segmentAt(double t, double turn, double x) {
  const double angle = turn * (t - 0.5);
  const Vector3d half = 0.002 * Vector3d(0.0, std::sin(angle), std::cos(angle));
  const Vector3d middle(x, 0.0, 0.0005 * t);
  return {Vector3d(middle - half), Vector3d(middle + half)};
}

int passes(int steps, double turn, double x, double& place) {
  int found = 0;
  BladeSweep sweep;
  for (int n = 0; n < steps; ++n) {
    const double from = static_cast<double>(n) / steps, to = static_cast<double>(n + 1) / steps;
    sweep.from = bladeAt(from), sweep.to = bladeAt(to);
    double here;
    if (crosses(sweep, {segmentAt(from, turn, x), segmentAt(to, turn, x)}, 0.0, here)) ++found, place = here;
  }
  return found;
}

TEST(BladeSweep, WhatPassesIsFoundOnceHoweverManyStepsItTakes) {
  for (const double turn : {-2.0, 0.0, 0.7, 2.0})
    for (int i = 0; i < 7; ++i) {
      const double x = -0.008 + 0.0025 * i;
      double fine = 0;
      ASSERT_EQ(passes(4000, turn, x, fine), 1) << turn << ' ' << x;
      for (const int steps : {1, 2, 3, 7, 50, 333}) {
        double place = 0;
        EXPECT_EQ(passes(steps, turn, x, place), 1) << steps << " steps, turn " << turn << ", x " << x;
        if (steps >= 50) {
          EXPECT_NEAR(place, fine, 0.01);
        }
      }
    }
}

TEST(BladeSweep, WhatLiesBesideTheBladeOrGoesWithItDoesNotPass) {
  double place;
  EXPECT_EQ(passes(50, 0.5, 0.012, place), 0) << "beyond its end";
  BladeSweep sweep;
  sweep.from = bladeAt(0.2), sweep.to = bladeAt(0.8);
  const Vector3d way = sweep.to[0] - sweep.from[0], turned = sweep.to[1] - sweep.from[1];
  const std::array<Vector3d, 2> ahead = {Vector3d(0, 0, -0.002), Vector3d(0, 0, 0.002)};
  const Vector3d mean = 0.5 * (way + turned);
  EXPECT_FALSE(crosses(sweep, {ahead, {Vector3d(ahead[0] + mean), Vector3d(ahead[1] + mean)}}, 0.0, place))
      << "the tissue gives way";
  sweep.to = sweep.from;
  EXPECT_TRUE(crosses(
      sweep, {segmentAt(0.5, 0, 0), {Vector3d(0, -0.003, -0.002), Vector3d(0, -0.003, 0.002)}}, 0.0, place))
      << "tissue comes past a blade that stands still";
}

}  // namespace
}  // namespace vest::interaction
