// Protects the feel of contact: what is shown between two updates, on retreat, while grasping, and at
// updates.
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include <gtest/gtest.h>
#include <Eigen/Cholesky>

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

namespace {

/// Stiff surfaces that all touch at x0.
TissueModel corner(const std::vector<Vector3d>& normals, const std::vector<double>& offsets,
                   const Vector3d& x0, double k) {
  HalfSpace any;
  auto r = any.step({0, 0, any.level - 0.001}, 0)->contacts[0];
  Eigen::Matrix3d stiffness = Eigen::Matrix3d::Zero();
  Vector3d force = Vector3d::Zero();
  r.plane_count = normals.size();
  for (std::size_t i = 0; i < normals.size(); ++i) {
    stiffness += k * normals[i] * normals[i].transpose();
    force += k * (offsets[i] - normals[i].dot(x0)) * normals[i];
    for (int e = 0; e < 3; ++e) r.planes[i][e] = normals[i][e];
    r.planes[i][3] = offsets[i];
  }
  for (int i = 0; i < 3; ++i) {
    r.position[i] = x0[i];
    r.wrench[i] = force[i];
    for (int j = 0; j < 3; ++j) r.stiffness[6 * i + j] = stiffness(i, j);
  }
  r.radius = 1.0;
  TissueModel m;
  EXPECT_TRUE(toModel(r, m));
  return m;
}

/// The point of { n·p ≥ o } nearest to x, by trying every set of planes that may hold it.
Vector3d nearest(const std::vector<Vector3d>& n, const std::vector<double>& o, const Vector3d& x) {
  Vector3d best = Vector3d::Constant(1e9);
  for (unsigned set = 0; set < 1u << n.size(); ++set) {
    Eigen::MatrixXd a(3, 0);
    Eigen::VectorXd b(0);
    for (std::size_t i = 0; i < n.size(); ++i) {
      if (!(set >> i & 1u)) continue;
      a.conservativeResize(3, a.cols() + 1);
      b.conservativeResize(b.size() + 1);
      a.col(a.cols() - 1) = n[i];
      b[b.size() - 1] = o[i] - n[i].dot(x);
    }
    if (a.cols() > 3) continue;
    Vector3d p = x;
    if (a.cols() > 0) p += a * Eigen::MatrixXd(a.transpose() * a).ldlt().solve(b);
    bool free = true;
    for (std::size_t i = 0; i < n.size(); ++i) free &= n[i].dot(p) >= o[i] - 1e-9;
    if (free && (p - x).norm() < (best - x).norm()) best = p;
  }
  return best;
}

}  // namespace

TEST(ContactForce, OnRigidPlanesTheProxyIsThePointOfFreeSpaceNearestToTheHand) {
  std::mt19937 random(7);
  std::normal_distribution<double> gauss;
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  const auto count = counted(100000, 2000, "corners of one to four rigid planes");
  const double coupling = 1000.0;
  int corners = 0;
  for (int trial = 0; trial < count; ++trial) {
    std::vector<Vector3d> n;
    std::vector<double> o;
    const Vector3d x0(0.01, 0.02, 0.05);
    for (int i = 0, planes = 1 + trial % 4; i < 40 && static_cast<int>(n.size()) < planes; ++i) {
      Vector3d normal(gauss(random), gauss(random), 1.0 + std::abs(gauss(random)));
      normal.normalize();
      bool apart = true;
      for (const Vector3d& other : n) apart &= normal.dot(other) < 0.85;
      if (!apart) continue;
      n.push_back(normal);
      o.push_back(normal.dot(x0) + 1e-7);  // touched
    }
    ContactForce c(coupling);
    const Vector3d x = x0 + 0.002 * Vector3d(uniform(random), uniform(random), uniform(random));
    c.update(corner(n, o, x0, 1e6), x, Vector3d::Zero());
    const Vector3d expected = nearest(n, o, x);
    corners += n.size() > 1 && (expected - x0).norm() < 1e-6;
    ASSERT_NEAR((c.proxy(x, Vector3d::Zero()) - expected).norm(), 0.0, 5e-6) << "trial " << trial;
    ASSERT_NEAR((settled(c, x) - coupling * (expected - x)).norm(), 0.0, 0.01) << "trial " << trial;
  }
  EXPECT_GT(corners, count / 100) << "hands behind corners are among them";
}

TEST(ContactForce, WhoLeavesOneSurfaceOfACornerStillRestsOnTheOther) {
  const Vector3d floor(0, 0, 1), wall(1, 0, 0), x0(0, 0, 0);
  ContactForce c(1000.0);
  const Vector3d in(-0.001, 0, -0.002);
  c.update(corner({floor, wall}, {1e-7, 1e-7}, x0, 1e7), in, Vector3d::Zero());
  EXPECT_NEAR((settled(c, in) - Vector3d(1.0, 0, 2.0)).norm(), 0.0, 0.01);
  EXPECT_NEAR((settled(c, {0.001, 0, -0.002}) - Vector3d(0, 0, 2.0)).norm(), 0.0, 0.01) << "off the wall";
  EXPECT_NEAR((settled(c, {-0.001, 0, 0.001}) - Vector3d(1.0, 0, 0)).norm(), 0.0, 0.01) << "off the floor";
  EXPECT_EQ(settled(c, {0.001, 0, 0.001}).norm(), 0.0);
}

TEST(ContactForce, WhatOneSurfaceHeldAloneEndsWhereItIsLeft) {
  const Vector3d floor(0, 0, 1), wall(1, 0, 0), x0(0, 0, 0);
  ContactForce c(1000.0);
  TissueModel m = corner({floor, wall}, {1e-3, 1e-3}, x0, 1000.0);
  m.force.x() += 0.5;  // the wall is harder than its plane says
  c.update(m, x0, Vector3d::Zero());
  const Vector3d f = settled(c, {0.003, 0, 0});
  EXPECT_NEAR(f.x(), 0.0, 1e-6);
  EXPECT_NEAR(f.z(), 0.5, 1e-6);
}

TEST(ContactForce, AModelWithoutPlanesPushesAndPulls) {
  HalfSpace tissue;
  ContactForce c(1e9);
  const Vector3d x(0, 0, 0.053);
  TissueModel m = modelAt(tissue, x);
  m.planes = 0;
  c.update(m, x, Vector3d::Zero());
  EXPECT_NEAR(settled(c, {0, 0, 0.0565}).z(), 0.6 - 300.0 * 0.0035, 1e-6);
}

TEST(ContactForce, AnotherCouplingAddsNoJumpAndIsReachedWithinMilliseconds) {
  HalfSpace tissue;
  tissue.stiffness = 1000.0;
  ContactForce c(1000.0);
  const Vector3d x(0, 0, 0.053);
  c.update(modelAt(tissue, x), x, Vector3d::Zero());
  EXPECT_NEAR(settled(c, x).z(), 1.0, 1e-6);
  c.couple(250.0, x, Vector3d::Zero());
  EXPECT_NEAR(c.evaluate(x, Vector3d::Zero(), 1e-9).z(), 1.0, 1e-5);
  EXPECT_NEAR(settled(c, x).z(), 0.002 / (1.0 / 1000.0 + 1.0 / 250.0), 1e-6);
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
  EXPECT_NEAR(c.trueForce({0, 0, 0.0565}, Vector3d::Zero()).z(), 0.6 - 300.0 * 0.0035, 1e-6);
}

TEST(ContactForce, BeyondItsRadiusTheModelIsNotExtrapolated) {
  HalfSpace tissue;
  ContactForce c(1e9);
  const Vector3d x(0, 0, 0.053);
  c.update(modelAt(tissue, x), x, Vector3d::Zero());
  EXPECT_NEAR(settled(c, {0, 0, 0.0}).z(), 0.6 + 300.0 * 0.005, 1e-4);
}

TEST(ContactForce, WhileANewModelIsBlendedInNothingPulls) {
  HalfSpace tissue;
  ContactForce c(1e9);
  const Vector3d x(0, 0, 0.053);
  tissue.stiffness = 100.0;
  c.update(modelAt(tissue, x), x, Vector3d::Zero());
  settled(c, x);
  tissue.stiffness = 2000.0;  // what is missing to it is still taken off
  c.update(modelAt(tissue, x), x, Vector3d::Zero());
  EXPECT_GE(c.evaluate({0, 0, 0.056}, Vector3d::Zero(), 1e-4).z(), 0.0) << "out of the tissue";
}

TEST(ContactForce, WhereAModelIsLeftFarBehindTheCouplingBoundsTheForceToo) {
  HalfSpace tissue;
  tissue.stiffness = 1e5;
  ContactForce c(400.0);
  const Vector3d x(0, 0, 0.045);  // 10 mm deep, twice the model's radius: 1 kN
  c.update(modelAt(tissue, x), x, Vector3d::Zero());
  EXPECT_LE(settled(c, x).z(), 400.0 * 0.010);
  EXPECT_GT(settled(c, x).z(), 1.0);
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
                                &r.stiffness[35], &r.damping[35],  &r.radius,      &r.jaw_torque,
                                &r.planes[0][0],  &r.planes[0][3]};
      *fields[field] = v;
      EXPECT_FALSE(toModel(r, m)) << "field " << field;
    }
  }
  vest::shared::ContactRecord r = good;
  r.plane_count = 5;
  const char* why = "";
  EXPECT_FALSE(toModel(r, m, &why)) << "more planes than there are";
  EXPECT_STREQ(why, "number of planes") << "before one that is not there was looked at";
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
