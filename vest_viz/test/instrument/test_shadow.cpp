// Protects the instruments' shadows: they are those of rays from a lamp's disc to the tissue, counted one by
// one.
#include "vest_viz/instrument/shadow.h"

#include <cmath>
#include <random>

#include <gtest/gtest.h>
#include <Eigen/Geometry>

namespace vest::instrument {
namespace {

using Eigen::Vector3d;

constexpr double kRadius = 0.0025;
const Vector3d kLamp(0, 0.004, 0), kTip(-0.005, -0.002, -0.060), kFar(0.09, 0.03, -0.010);

/// Whether the way from a to b meets the shaft: sampled along the way.
bool meets(const Vector3d& a, const Vector3d& b) {
  const Vector3d along = (kFar - kTip).normalized();
  for (int i = 0; i <= 400; ++i) {
    const Vector3d p = a + (b - a) * (i / 400.0) - kTip;
    const double t = p.dot(along);
    if (t > 0 && (p - along * t).norm() < kRadius) return true;
  }
  return false;
}

/// Share of a disc of the lamp's radius that does not see p.
double counted(const Vector3d& p) {
  const Vector3d to = (p - kLamp).normalized(), u = to.unitOrthogonal(), v = to.cross(u);
  int hidden = 0, all = 0;
  for (int i = -6; i <= 6; ++i)
    for (int j = -6; j <= 6; ++j) {
      if (i * i + j * j > 36) continue;
      ++all;
      hidden += meets(kLamp + kLampRadius * (i * u + j * v) / 6, p);
    }
  return static_cast<double>(hidden) / all;
}

TEST(CastShadow, IsTheShareOfTheLampThatTheShaftHides) {
  const CastShadow shadow = castShadow(kLamp, kTip, kFar, kRadius);
  const Vector3d along = (kFar - kTip).normalized();
  std::mt19937 random(3);
  std::uniform_real_distribution<double> way(0.005, 0.05), aside(-0.006, 0.006), behind(1.1, 1.8);
  double off = 0, worst = 0;
  int dark = 0, lit = 0, between = 0;
  for (int i = 0; i < 500; ++i) {
    const Vector3d beside = along.cross(kTip - kLamp).normalized();
    const Vector3d p = kLamp + behind(random) * (kTip + way(random) * along + aside(random) * beside - kLamp);
    const double expected = counted(p), is = shadowAt(shadow, p, kRadius);
    off += std::fabs(is - expected) / 500;
    worst = std::max(worst, std::fabs(is - expected));
    (expected > 0.95 ? dark : expected < 0.05 ? lit : between) += 1;
  }
  EXPECT_GT(dark, 100);
  EXPECT_GT(lit, 100);
  EXPECT_GT(between, 50);
  EXPECT_LT(off, 0.02) << "of the whole light";
  EXPECT_LT(worst, 0.15) << "edges are straight ramps instead of a disc's";
}

TEST(CastShadow, NothingIsShadedBeforeTheShaftBeyondItsEndAndWithoutIt) {
  const CastShadow shadow = castShadow(kLamp, kTip, kFar, kRadius);
  const Vector3d middle = 0.5 * (kTip + kFar), along = (kFar - kTip).normalized();
  EXPECT_GT(shadowAt(shadow, kLamp + 1.3 * (middle - kLamp), kRadius), 0.95);
  EXPECT_EQ(shadowAt(shadow, kLamp + 0.8 * (middle - kLamp), kRadius), 0);
  EXPECT_EQ(shadowAt(shadow, kLamp + 1.3 * (kTip - 0.01 * along - kLamp), kRadius), 0);
  EXPECT_EQ(shadowAt(castShadow(kLamp, kTip, kTip, kRadius), kTip * 1.4, kRadius), 0) << "no length";
  EXPECT_EQ(shadowAt(castShadow(kTip, kTip, kFar, kRadius), kTip * 1.4, kRadius), 0) << "lamp in the shaft";
}

}  // namespace
}  // namespace vest::instrument
