// What jaws hold is drawn between them.
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "vest_viz/instrument/jaws.h"

namespace vest::instrument {
namespace {

using Eigen::Vector3d;

/// Skin of a tube of 4 mm radius that lies across the jaws, 5 mm behind their point, along their axis y.
std::vector<float> tube(const Eigen::Isometry3d& X) {
  std::vector<float> p;
  for (int i = -20; i <= 20; ++i)
    for (int k = 0; k < 24; ++k) {
      const double a = 2 * M_PI * k / 24;
      const Vector3d q = X * Vector3d(0.004 * std::cos(a), 0.001 * i, -0.005 + 0.004 * std::sin(a));
      for (int d = 0; d < 3; ++d) p.push_back(static_cast<float>(q[d]));
    }
  return p;
}

Jaws closedBy(double opening) {
  Jaws jaws;
  jaws.X_WTip =
      Eigen::Translation3d(0.03, -0.02, 0.05) * Eigen::AngleAxisd(0.7, Vector3d(1, 2, -1).normalized());
  jaws.opening = opening;
  jaws.length = 0.022;
  return jaws;
}

TEST(Jaws, TheTubeThatTheyHoldDoesNotPassThroughThem) {
  const Jaws jaws = closedBy(0.1);
  std::vector<float> p = tube(jaws.X_WTip);
  const std::vector<float> before = p;
  ASSERT_TRUE(pressBetween(jaws, &p));
  for (std::size_t k = 0; k < p.size(); k += 3) {
    const Vector3d q = jaws.X_WTip.inverse() * Vector3d(p[k], p[k + 1], p[k + 2]);
    const Vector3d was = jaws.X_WTip.inverse() * Vector3d(before[k], before[k + 1], before[k + 2]);
    if (std::fabs(q.y()) < 0.002 && q.z() < 0) {
      EXPECT_LT(std::fabs(q.x()), (q.z() + jaws.length) * std::tan(0.05) + 0.0002) << q.transpose();
    }
    if (std::fabs(q.y()) > 0.0055) {
      EXPECT_LT((q - was).norm(), 1e-6) << "beside the jaws it stays as it is";
    }
    EXPECT_NEAR(q.y(), was.y(), 1e-6);
    EXPECT_NEAR(q.z(), was.z(), 1e-6) << "it is pressed, not pushed";
    EXPECT_LE(std::fabs(q.x()), std::fabs(was.x()) + 1e-6);
    EXPECT_GE(q.x() * was.x(), -1e-9) << "neither side passes the other";
  }
}

TEST(Jaws, WhatHasRoomBetweenThemIsDrawnAsItIs) {
  const Jaws jaws = closedBy(1.0);
  std::vector<float> p = tube(jaws.X_WTip);
  const std::vector<float> before = p;
  EXPECT_FALSE(pressBetween(jaws, &p));
  EXPECT_EQ(p, before);
}

TEST(Jaws, NotANumberIsLeftAlone) {
  Jaws jaws = closedBy(0.1);
  std::vector<float> p{std::nanf(""), 0, 0, 1e30f, 0, 0};
  EXPECT_FALSE(pressBetween(jaws, &p));
}

}  // namespace
}  // namespace vest::instrument
