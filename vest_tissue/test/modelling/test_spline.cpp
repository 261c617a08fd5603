#include <cmath>
#include <stdexcept>

#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include "vest_tissue/modelling/spline.h"

using namespace vest::modelling;

TEST(Spline, CatmullRomWeightsSumToOneAndPassThroughTheControlPoints) {
  for (double t = 0; t <= 1.0; t += 0.125) {
    const auto w = catmullRom(t);
    EXPECT_NEAR(w[0] + w[1] + w[2] + w[3], 1.0, 1e-14);
    EXPECT_NEAR(-w[0] + w[2] + 2 * w[3], t, 1e-14) << "reproduces a straight line";
  }
  EXPECT_EQ(catmullRom(0.0)[1], 1.0);
  EXPECT_EQ(catmullRom(1.0)[2], 1.0);
}

TEST(Spline, ACurveIsWalkedByArcLength) {
  const Curve curve({{0, 0, 0}, {0.01, 0, 0}, {0.05, 0, 0}});
  EXPECT_NEAR(curve.length(), 0.05, 1e-9);
  EXPECT_NEAR(curve.at(0.02).x(), 0.02, 1e-5) << "control points of unequal spacing must not matter";
  EXPECT_NEAR(curve.at(0.06).x(), 0.06, 1e-9) << "straight on beyond the end";
  EXPECT_NEAR(curve.tangent(0.03).x(), 1.0, 1e-12);
}

TEST(Spline, ACurveRefusesOnePointAndDoublePoints) {
  EXPECT_THROW(Curve({{0, 0, 0}}), std::invalid_argument);
  EXPECT_THROW(Curve({{0, 0, 0}, {0, 0, 0}}), std::invalid_argument);
}

TEST(Spline, FramesStayOrthonormalAndDoNotTwistOnAPlaneCurve) {
  const Curve curve({{0, 0, 0}, {0.02, 0.01, 0}, {0.04, 0, 0}, {0.05, -0.03, 0}});
  std::vector<double> arcs;
  for (int i = 0; i <= 20; ++i) arcs.push_back(curve.length() * i / 20);
  for (const auto& frame : framesAlong(curve, arcs, {0, 0, 1})) {
    EXPECT_NEAR(frame.x.dot(frame.tangent), 0, 1e-12);
    EXPECT_NEAR((frame.x.cross(frame.y) - frame.tangent).norm(), 0, 1e-12);
    EXPECT_NEAR(frame.x.z(), 1.0, 1e-9) << "the binormal of a plane curve stays";
  }
  EXPECT_THROW(framesAlong(Curve({{0, 0, 0}, {0, 0, 1}}), {0.0}, {0, 0, 1}), std::invalid_argument);
}

TEST(Spline, PolarSectionsAreCirclesEllipsesAndClosedSplines) {
  EXPECT_EQ(polarRadius({0.003}, 1.234), 0.003);
  EXPECT_NEAR(polarRadius({0.02, 0.01}, 0.0), 0.02, 1e-15);
  EXPECT_NEAR(polarRadius({0.02, 0.01}, std::acos(-1.0) / 2), 0.01, 1e-15);
  const std::vector<double> closed{1.0, 1.2, 0.9, 1.1};
  for (int k = 0; k < 4; ++k) EXPECT_NEAR(polarRadius(closed, k * std::acos(-1.0) / 2), closed[k], 1e-12);
  EXPECT_NEAR(polarRadius(closed, -1e-9), polarRadius(closed, 1e-9), 1e-8) << "closed at angle 0";
}

TEST(Spline, SectionsDoNotOvershootBetweenTheirNeighbours) {
  const std::vector<Section> sections{{0.0, {0.01}}, {0.4, {0.01}}, {0.5, {0.02}}, {1.0, {0.02}}};
  for (double at = 0; at <= 1.0; at += 0.01) {
    const double radius = sectionRadius(sections, at, 0.3);
    EXPECT_GE(radius, 0.01 - 1e-15);
    EXPECT_LE(radius, 0.02 + 1e-15);
  }
}
