#include <cmath>
#include <limits>
#include <random>

#include <gtest/gtest.h>

#include "vest_instruments/kinematics/arm.h"

namespace {

using namespace vest::kinematics;
using Eigen::Isometry3d;
using Eigen::Vector3d;

Isometry3d someTrocar() {
  Isometry3d X = Isometry3d::Identity();
  X.rotate(Eigen::AngleAxisd(2.1, Vector3d(0.3, -1.0, 0.4).normalized()));
  X.pretranslate(Vector3d(-0.115, -0.02, 0.165));
  return X;
}

struct RandomJoints {
  std::mt19937_64 engine{7};
  JointPositions operator()() {
    auto in = [&](double a, double b) { return std::uniform_real_distribution<double>(a, b)(engine); };
    return {in(-1.19, 1.19), in(-1.19, 1.19), in(0.001, 0.29), in(-3.14, 3.14), in(0, 1.2)};
  }
};

// Drawn by hand from docs/conventions.md: yaw about y, pitch about the turned x, insertion, roll about z.
TEST(Kinematics, ForwardMatchesCasesWorkedOutByHand) {
  const Isometry3d I = Isometry3d::Identity();
  EXPECT_TRUE(
      forwardKinematics(I, {0, 0, 0.1, 0, 0}).isApprox(Isometry3d(Eigen::Translation3d(0, 0, 0.1)), 1e-15));
  // Yaw of +90 degrees about y swings the shaft to +x.
  EXPECT_TRUE(
      forwardKinematics(I, {M_PI / 2, 0, 0.1, 0, 0}).translation().isApprox(Vector3d(0.1, 0, 0), 1e-12));
  // Pitch of +90 degrees about x swings it to -y.
  EXPECT_TRUE(
      forwardKinematics(I, {0, M_PI / 2, 0.1, 0, 0}).translation().isApprox(Vector3d(0, -0.1, 0), 1e-12));
  // Pitch turns about the x that yaw has turned: both at 90 degrees leave the tip at -y.
  EXPECT_TRUE(forwardKinematics(I, {M_PI / 2, M_PI / 2, 0.1, 0, 0})
                  .translation()
                  .isApprox(Vector3d(0, -0.1, 0), 1e-12));
  // Roll turns the opening direction x to y and moves nothing.
  const Isometry3d rolled = forwardKinematics(I, {0, 0, 0.2, M_PI / 2, 0});
  EXPECT_TRUE(rolled.linear().col(0).isApprox(Vector3d::UnitY(), 1e-12));
  EXPECT_TRUE(rolled.translation().isApprox(Vector3d(0, 0, 0.2), 1e-12));
}

TEST(Kinematics, InverseUndoesForwardForRandomJoints) {
  RandomJoints draw;
  const Isometry3d X = someTrocar();
  for (int i = 0; i < 2000; ++i) {
    const JointPositions q = draw();
    JointPositions reference;
    reference.jaw = q.jaw;
    const InverseResult r = inverseKinematics(X, forwardKinematics(X, q), reference, JointLimits{});
    ASSERT_TRUE(r.reachable);
    EXPECT_NEAR(r.q.yaw, q.yaw, 1e-9);
    EXPECT_NEAR(r.q.pitch, q.pitch, 1e-9);
    EXPECT_NEAR(r.q.insertion, q.insertion, 1e-12);
    EXPECT_NEAR(r.q.roll, q.roll, 1e-9);
    EXPECT_EQ(r.q.jaw, q.jaw);
  }
}

// Position exact, roll nearest: an attitude that the trocar does not allow leaves the position alone.
TEST(Kinematics, AnAttitudeOutOfReachLeavesThePositionExactAndTheRollNearest) {
  RandomJoints draw;
  const Isometry3d X = someTrocar();
  for (int i = 0; i < 200; ++i) {
    const JointPositions q = draw();
    Isometry3d wanted = forwardKinematics(X, q);
    wanted.linear() =
        wanted.linear() * Eigen::AngleAxisd(0.6, Vector3d(1, 0.5, 0.2).normalized()).toRotationMatrix();
    const InverseResult r = inverseKinematics(X, wanted, {}, JointLimits{});
    ASSERT_TRUE(r.reachable);
    const Isometry3d got = forwardKinematics(X, r.q);
    EXPECT_TRUE(got.translation().isApprox(wanted.translation(), 1e-9));
    const double best = (got.linear().transpose() * wanted.linear()).trace();
    for (const double d : {-0.01, 0.01}) {
      JointPositions other = r.q;
      other.roll += d;
      EXPECT_LT((forwardKinematics(X, other).linear().transpose() * wanted.linear()).trace(), best);
    }
  }
}

TEST(Kinematics, BeyondTheLimitsTheNearestReachableTipIsGivenAndSaid) {
  const Isometry3d I = Isometry3d::Identity();
  JointLimits limits;
  const InverseResult deep = inverseKinematics(I, Isometry3d(Eigen::Translation3d(0, 0, 0.5)), {}, limits);
  EXPECT_FALSE(deep.reachable);
  EXPECT_EQ(deep.q.insertion, limits.upper.insertion);
  const InverseResult outside =
      inverseKinematics(I, Isometry3d(Eigen::Translation3d(0, 0, -0.05)), {}, limits);
  EXPECT_FALSE(outside.reachable);
  EXPECT_EQ(outside.q.insertion, 0.0);
  const InverseResult wide =
      inverseKinematics(I, Isometry3d(Eigen::Translation3d(0.2, 0.0, 0.02)), {}, limits);
  EXPECT_FALSE(wide.reachable);
  EXPECT_EQ(wide.q.yaw, limits.upper.yaw);
  EXPECT_NEAR(wide.q.insertion, 0.2 * std::sin(1.2) + 0.02 * std::cos(1.2), 1e-12);
}

TEST(Kinematics, RollStaysOnTheTurnOfTheReferenceAndStopsAtTheLimit) {
  const Isometry3d I = Isometry3d::Identity();
  JointPositions q{0, 0, 0.1, 3.0, 0};
  JointPositions reference = q;
  q.roll = 3.3;  // beyond pi: the joint stops instead of jumping by a turn
  EXPECT_NEAR(inverseKinematics(I, forwardKinematics(I, q), reference, JointLimits{}).q.roll, M_PI, 1e-9);
  JointLimits wide;
  wide.upper.roll = 10.0;
  EXPECT_NEAR(inverseKinematics(I, forwardKinematics(I, q), reference, wide).q.roll, 3.3, 1e-9);
}

TEST(Kinematics, AtThePivotAndForNonFiniteInputTheReferenceIsKept) {
  const Isometry3d I = Isometry3d::Identity();
  const JointPositions reference{0.3, -0.2, 0.1, 0.5, 0.7};
  const InverseResult at_pivot = inverseKinematics(I, I, reference, JointLimits{});
  EXPECT_TRUE(at_pivot.reachable);
  EXPECT_EQ(at_pivot.q.yaw, reference.yaw);
  EXPECT_EQ(at_pivot.q.pitch, reference.pitch);
  EXPECT_EQ(at_pivot.q.insertion, 0.0);
  Isometry3d bad = I;
  bad.translation().x() = std::numeric_limits<double>::quiet_NaN();
  const InverseResult r = inverseKinematics(I, bad, reference, JointLimits{});
  EXPECT_FALSE(r.reachable);
  EXPECT_EQ(r.q.yaw, reference.yaw);
  EXPECT_EQ(r.q.insertion, reference.insertion);
}

}  // namespace
