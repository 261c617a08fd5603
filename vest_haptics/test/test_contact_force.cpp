// Protects the feel of contact: what is shown between two updates, on retreat, while grasping, and at
// updates.
#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "support.h"

using namespace vest::haptics;
using namespace vest::haptics::testing;
using Eigen::Vector3d;

namespace {

TissueModel modelAt(HalfSpace& tissue, const Vector3d& x) {
  TissueModel m;
  EXPECT_TRUE(toModel(tissue.step(x, 0)->contacts[0], m));
  return m;
}

Vector3d settled(ContactForce& c, const Vector3d& x) {
  Vector3d f = Vector3d::Zero();
  for (int i = 0; i < 60; ++i) f = c.evaluate(x, Vector3d::Zero(), 0.001);
  return f;
}

}  // namespace

TEST(ContactForce, BetweenUpdatesItFollowsTheLocalModel) {
  HalfSpace tissue;
  ContactForce c(1e9);
  const Vector3d x(0, 0, 0.053), y(0, 0, 0.0525);
  c.update(modelAt(tissue, x), x, Vector3d::Zero());
  EXPECT_NEAR(settled(c, x).z(), 0.6, 1e-6);
  EXPECT_NEAR(settled(c, y).z(), 0.75, 1e-6);
  EXPECT_NEAR(c.trueForce(y, Vector3d::Zero()).z(), 0.75, 1e-12);
  EXPECT_NEAR(c.trueForce(y, Vector3d(0, 0, -0.1)).z(), 0.75, 1e-12) << "no damping, no effect of speed";
}

TEST(ContactForce, TissuePushesAndDoesNotPullOnRetreat) {
  HalfSpace tissue;
  ContactForce c(1e9);
  const Vector3d x(0, 0, 0.053);
  c.update(modelAt(tissue, x), x, Vector3d::Zero());
  settled(c, x);
  for (double z = 0.053; z < 0.058; z += 0.0001) {
    const Vector3d f = settled(c, {0, 0, z});
    EXPECT_GE(f.z(), 0.0) << z;
    if (z > 0.0551) {
      EXPECT_EQ(f.norm(), 0.0) << "beyond the plane there is no force, at " << z;
    }
  }
}

TEST(ContactForce, FrictionEndsWhereThePushEnds) {
  HalfSpace tissue;
  ContactForce c(1e9);
  const Vector3d x(0, 0, 0.053);
  tissue.step(x, 0);
  auto& r = tissue.image.contacts[0];
  r.wrench[0] = 0.06;  // friction, a tenth of the push
  r.stiffness[0] = 300.0;
  TissueModel m;
  ASSERT_TRUE(toModel(r, m));
  c.update(m, x, Vector3d::Zero());
  const Vector3d slid = settled(c, {-0.004, 0, 0.053});
  EXPECT_NEAR(slid.x(), (0.1 + ContactForce::kExtraFriction) * 0.6, 1e-6)
      << "Coulomb's cone, not a spring that sticks";
  EXPECT_NEAR(settled(c, {-0.004, 0, 0.0551}).norm(), 0.0, 1e-9);
}

TEST(ContactForce, WhatIsGraspedPullsToo) {
  HalfSpace tissue;
  ContactForce c(1e9);
  const Vector3d x(0, 0, 0.053);
  tissue.step(x, 0);
  auto& r = tissue.image.contacts[0];
  r.flags |= vest::shared::kFlagGrasping;
  TissueModel m;
  ASSERT_TRUE(toModel(r, m));
  c.update(m, x, Vector3d::Zero());
  EXPECT_NEAR(settled(c, {0, 0, 0.0565}).z(), 0.6 - 300.0 * 0.0035, 1e-6);
}

TEST(ContactForce, BeyondItsRadiusTheModelIsNotExtrapolated) {
  HalfSpace tissue;
  ContactForce c(1e9);
  const Vector3d x(0, 0, 0.053);
  c.update(modelAt(tissue, x), x, Vector3d::Zero());
  EXPECT_NEAR(settled(c, {0, 0, 0.0}).z(), 0.6 + 300.0 * 0.005, 1e-4);
}

TEST(ContactForce, ShownStiffnessNeverExceedsTheCoupling) {
  HalfSpace tissue;
  tissue.stiffness = 50000.0;
  ContactForce c(400.0);
  const Vector3d x(0, 0, 0.054), y(0, 0, 0.0539);
  c.update(modelAt(tissue, x), x, Vector3d::Zero());
  const double k = (settled(c, y).z() - settled(c, x).z()) / 0.0001;
  EXPECT_LT(k, 400.0);
  EXPECT_GT(k, 390.0);
  HalfSpace soft;
  soft.stiffness = 50.0;
  ContactForce d(400.0);
  d.update(modelAt(soft, x), x, Vector3d::Zero());
  EXPECT_NEAR((settled(d, y).z() - settled(d, x).z()) / 0.0001, 1.0 / (1.0 / 50.0 + 1.0 / 400.0), 0.01);
}

TEST(ContactForce, ANewModelAddsNoJumpAndIsReachedWithinMilliseconds) {
  HalfSpace tissue;
  ContactForce c(1e9);
  const Vector3d x(0, 0, 0.053);
  c.update(modelAt(tissue, x), x, Vector3d::Zero());
  const double before = settled(c, x).z();
  tissue.stiffness = 900.0;
  c.update(modelAt(tissue, x), x, Vector3d::Zero());
  const double at = c.evaluate(x, Vector3d::Zero(), 1e-9).z();
  EXPECT_NEAR(at, before, 1e-5);
  double last = at;
  for (int i = 0; i < 20; ++i) {
    const double f = c.evaluate(x, Vector3d::Zero(), 0.001).z();
    EXPECT_GE(f, last);
    last = f;
  }
  EXPECT_NEAR(last, 1.8, 0.01);
}

TEST(ContactForce, ARecordWithoutContactIsNoForceAndGivesNothingBack) {
  HalfSpace tissue;
  ContactForce c(400.0);
  const Vector3d x(0, 0, 0.053);
  tissue.step(x, 0);
  auto& r = tissue.image.contacts[0];
  r.flags = vest::shared::kFlagPresent;
  TissueModel m;
  ASSERT_TRUE(toModel(r, m));
  c.update(m, x, Vector3d::Zero());
  EXPECT_EQ(settled(c, x).norm(), 0.0);
  EXPECT_EQ(c.trueForce(x, Vector3d::Zero()).norm(), 0.0);
  const double nothing = c.storedEnergy();
  EXPECT_LT(nothing, 0.0021) << "a margin for the noise of sensors, no more";
  // A force without stiffness is stored in the coupling alone: 1.5 F^2 / 2 Kc.
  r.flags |= vest::shared::kFlagContact;
  for (double& k : r.stiffness) k = 0.0;
  ASSERT_TRUE(toModel(r, m));
  c.update(m, x, Vector3d::Zero());
  const double f = settled(c, x).z();
  EXPECT_NEAR(c.storedEnergy() - nothing, 1.5 * f * f / 2.0 / 400.0, 1e-9);
}

TEST(ContactForce, WithoutAPushInTheModelOnlyTheExtraFrictionHolds) {
  HalfSpace tissue;
  ContactForce c(1e9);
  const Vector3d x(0, 0, 0.053);
  tissue.step(x, 0);
  auto& r = tissue.image.contacts[0];
  r.wrench[2] = 0.0;
  r.stiffness[0] = 300.0;
  TissueModel m;
  ASSERT_TRUE(toModel(r, m));
  c.update(m, x, Vector3d::Zero());
  const Vector3d f = settled(c, {-0.003, 0, 0.052});
  EXPECT_NEAR(f.z(), 0.3, 1e-6);
  EXPECT_NEAR(f.x(), ContactForce::kExtraFriction * 0.3, 1e-6);
}

TEST(ContactForce, DampingOfContactIsBounded) {
  HalfSpace tissue;
  tissue.damping = 1000.0;
  ContactForce c(1e9);
  const Vector3d x(0, 0, 0.053), v(0, 0, -0.01);
  c.update(modelAt(tissue, x), x, v);
  Vector3d f = Vector3d::Zero();
  for (int i = 0; i < 60; ++i) f = c.evaluate(x, v, 0.001);
  EXPECT_NEAR(f.z(), 0.6 + ContactForce::kMostDamping * 0.01, 1e-6);
}

TEST(ContactForce, NoRecordThatCannotBeBecomesAForce) {
  HalfSpace tissue;
  const Vector3d x(0, 0, 0.053);
  tissue.step(x, 0);
  const vest::shared::ContactRecord good = tissue.image.contacts[0];
  TissueModel m;
  ASSERT_TRUE(toModel(good, m));
  const double odd[] = {std::nan(""), std::numeric_limits<double>::infinity()};
  for (const double v : odd) {
    for (int field = 0; field < 10; ++field) {
      vest::shared::ContactRecord r = good;
      double* const fields[] = {&r.position[1],   &r.commanded[2], &r.velocity[0], &r.wrench[3],
                                &r.stiffness[14], &r.damping[0],   &r.radius,      &r.jaw_torque,
                                &r.planes[0][0],  &r.planes[0][3]};
      *fields[field] = v;
      EXPECT_FALSE(toModel(r, m)) << "field " << field;
    }
  }
  vest::shared::ContactRecord r = good;
  r.plane_count = 5;
  EXPECT_FALSE(toModel(r, m)) << "more planes than there are";
  r = good;
  r.stiffness[14] = 2e9;
  EXPECT_FALSE(toModel(r, m)) << "stiffness of nothing on earth";
  r = good;
  r.stiffness[14] = -1.0;
  EXPECT_FALSE(toModel(r, m)) << "negative stiffness";
  r = good;
  r.damping[0] = -0.1;
  EXPECT_FALSE(toModel(r, m)) << "negative damping";
  r = good;
  r.wrench[0] = 2e4;
  EXPECT_FALSE(toModel(r, m)) << "force beyond belief";
  r = good;
  r.radius = -0.001;
  EXPECT_FALSE(toModel(r, m)) << "negative radius";
  r = good;
  r.planes[0][0] = 1.0;
  EXPECT_FALSE(toModel(r, m)) << "a normal that is no unit vector";
}
