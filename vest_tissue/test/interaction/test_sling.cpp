#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "blades.h"
#include "theatre.h"
#include "vest_tissue/interaction/clip.h"
#include "vest_tissue/scene/world.h"

namespace {

using namespace vest;
using Eigen::Vector3d;

scene::Description stump(bool held = true) {
  specimen::TubeOptions o;
  o.radius = 0.004, o.rings = 24, o.length = 0.07, o.mass = 0.002, o.fix_ends = held;
  scene::Description d = specimen::tubeScene(o);
  d.gravity.setZero();
  if (!held)
    for (auto& g : d.objects[0].damping) g = 0.0;
  return d;
}

struct Theatre : test::Theatre {
  explicit Theatre(const scene::Description& d = stump(), int threads = 1) : test::Theatre(d, threads) {}
  /// The applicator from above; its loop hangs around the tube at x (the tool's x axis lies along y).
  void applicator(double x, bool draw) {
    auto& t = input.tools[0];
    t = specimen::grasper(Vector3d(x, 0, 0.05 + 0.0112 + 0.019), 0.0);
    t.tool = tools::ToolKind::SlingApplicator;
    t.pivot = Vector3d(x, 0, 0.2);
    if (draw) t.functions = tools::kFunctionFire;
  }
  scene::SlingView sling() {
    std::vector<scene::SlingView> all;
    world.slings(all);
    EXPECT_FALSE(all.empty());
    return all.empty() ? scene::SlingView{} : all[0];
  }
  double section(int ring) {
    std::vector<float> p(3 * world.knotCount(0));
    world.positions(0, p.data());
    std::array<Vector3d, 8> q;
    for (int i = 0; i < 8; ++i)
      q[i] = Vector3d(p[3 * (8 * ring + i)], p[3 * (8 * ring + i) + 1], p[3 * (8 * ring + i) + 2]);
    return interaction::polygonArea(q.data(), 8);
  }
  double narrowest() {
    double least = 1.0;
    for (int r = 0; r < 24; ++r) least = std::min(least, section(r));
    return least;
  }
};

double lengthOf(const scene::SlingView& s) {
  double sum = 0.0;
  for (std::size_t i = 0; i < s.positions.size(); ++i)
    sum += (s.positions[(i + 1) % s.positions.size()] - s.positions[i]).norm();
  return sum;
}

/// Of the links' lengths from l0/32, relative: the greatest.
double worstLink(const scene::SlingView& s) {
  double worst = 0.0;
  const double wanted = s.rest_length / static_cast<double>(s.positions.size());
  for (std::size_t i = 0; i < s.positions.size(); ++i) {
    const double l = (s.positions[(i + 1) % s.positions.size()] - s.positions[i]).norm();
    worst = std::max(worst, std::fabs(l / wanted - 1.0));
  }
  return worst;
}

TEST(Sling, HangsOpenAtItsApplicatorAndShortensByTheSameLawForAnyStep) {
  double rest[3];
  const double steps[3] = {0.001, 0.0005, 0.005};
  for (int n = 0; n < 3; ++n) {
    Theatre t;
    t.input.dt = steps[n];
    t.applicator(0.0, false);
    t.run(static_cast<int>(0.05 / steps[n] + 0.5));
    EXPECT_EQ(t.sling().rest_length, 0.120);
    EXPECT_NEAR(lengthOf(t.sling()), 0.120, 0.001) << "as long as it is";
    EXPECT_NEAR((t.sling().knot - Vector3d(0, 0, 0.069)).norm(), 0.0, 0.001) << "at the pusher's end";
    t.applicator(0.0, true);
    t.run(static_cast<int>(0.5 / steps[n] + 0.5));
    rest[n] = t.sling().rest_length;
    EXPECT_TRUE(t.sling().around);
    EXPECT_LT(worstLink(t.sling()), 0.02) << "it has come down on the tube, which gives way to it";
  }
  EXPECT_NEAR(rest[0], 0.120 * std::exp(-1.2 * 0.5), 1e-9);
  EXPECT_NEAR(rest[1], rest[0], 1e-9);
  EXPECT_NEAR(rest[2], rest[0], 1e-9);
}

TEST(Sling, TheLoopBeingDrawnHasTheSameShapeForAnyStep) {
  std::array<scene::SlingView, 3> loops;
  const double steps[3] = {0.001, 0.0005, 0.005};
  for (int n = 0; n < 3; ++n) {
    Theatre t;
    t.input.dt = steps[n];
    t.applicator(0.2, true);  // nothing in it
    t.run(static_cast<int>(0.5 / steps[n] + 0.5));
    loops[n] = t.sling();
    EXPECT_LT(worstLink(t.sling()), 1e-3);
    for (std::size_t i = 0; i < loops[0].positions.size(); ++i)
      EXPECT_LT((loops[n].positions[i] - loops[0].positions[i]).norm(), 1e-4) << "m, node " << i;
  }
}

// Protects against a loop that is drawn with its applicator as a picture: it has inertia, swings, and comes
// to rest; its links keep their length meanwhile.
TEST(Sling, TheLoopIsAChainThatSwingsBehindItsApplicatorAndComesToRest) {
  Theatre t;
  t.applicator(0.2, false);  // nothing in it
  t.run(100);
  const auto off = [&] {  // of the far end from where it hangs
    return Vector3d(t.sling().positions[16] - t.sling().knot - Vector3d(0, 0, -0.0382));
  };
  EXPECT_LT(off().norm(), 5e-4) << "its own weight bends it little";
  double most = 0.0;
  for (int i = 0; i < 60; ++i) {
    t.input.tools[0].position.x() += 0.0005;
    t.input.tools[0].pivot.x() += 0.0005;
    t.step();
    EXPECT_LT(worstLink(t.sling()), 5e-3);
    most = std::max(most, off().norm());
  }
  EXPECT_GT(most, 2e-4) << "m, left behind";
  t.run(400);
  EXPECT_LT(off().norm(), 5e-4) << "dilated again";
}

TEST(Sling, ALoopThatIsPressedOnTissueBendsAndDoesNotEnterIt) {
  Theatre t;
  t.applicator(0.0, false);
  t.input.tools[0].position.z() += 0.03;
  t.input.tools[0].pivot.z() += 0.03;
  // Turned by a right angle: the loop lies along the tube, its far end comes down on it.
  t.input.tools[0].orientation =
      Eigen::Quaterniond(Eigen::AngleAxisd(M_PI / 2, Vector3d::UnitZ())) * t.input.tools[0].orientation;
  t.run(20);
  double deepest = 1.0;
  for (int i = 0; i < 300; ++i) {
    t.input.tools[0].position.z() -= 0.0001;
    t.step();
    for (const Vector3d& p : t.sling().positions)
      if (std::fabs(p.x()) < 0.03) deepest = std::min(deepest, std::hypot(p.y(), p.z() - 0.05));
  }
  // The tube is a polygon of eight sides within its radius.
  EXPECT_GT(deepest, 0.0002 + 0.004 * std::cos(M_PI / 8) - 2e-4);
  EXPECT_LT(worstLink(t.sling()), 0.02);
  t.input.tools[0].position.z() += 0.03;
  t.run(500);
  EXPECT_LT((t.sling().positions[16] - t.sling().knot - Vector3d(0, 0, -0.0382)).norm(), 1e-3) << "dilated";
}

TEST(Sling, TiesTheTubeOffTellsWhereAndHoldsWithoutItsApplicator) {
  Theatre t;
  const double whole = t.section(12);
  t.applicator(0.0, false);
  t.run(20);
  t.applicator(0.0, true);
  for (int i = 0; i < 6000 && !t.sling().tied; ++i) t.step();
  ASSERT_TRUE(t.sling().tied);
  const scene::Event* e = nullptr;
  for (const auto& x : t.events)
    if (x.kind == scene::EventKind::Ligated) e = &x;
  ASSERT_NE(e, nullptr);
  EXPECT_NEAR(e->station, 0.035, 0.002);
  EXPECT_NEAR(e->area, whole, 0.02 * whole);
  EXPECT_GT(e->force, 0.0);
  EXPECT_LT(e->force, 20.1);
  EXPECT_EQ(e->instrument, 0);
  t.applicator(0.0, false);
  t.run(5);
  t.input.tools[0].present = false;
  const double rest = t.sling().rest_length;
  t.run(3000);
  EXPECT_EQ(t.sling().rest_length, rest) << "the knot holds";
  EXPECT_LT(t.narrowest(), 0.25 * whole);
  std::vector<scene::Attachment> attachments;
  t.world.attachments(attachments);
  ASSERT_EQ(attachments.size(), 1u);
  EXPECT_EQ(attachments[0].kind, 2);
  EXPECT_GT(attachments[0].closure, 0.9);
  EXPECT_LT(lengthOf(t.sling()), 0.025) << "drawn where it lies";
  EXPECT_NEAR(lengthOf(t.sling()), rest, 0.03 * rest) << "a loop of its own length";
}

// The ring that a thread closes changed by the millisecond: one sprang open, another was snatched shut.
TEST(Sling, DrawsATubeShutWithoutAWhip) {
  for (const double x : {0.0, 0.0013, 0.0022}) {
    Theatre t;
    t.applicator(x, true);
    double fastest = 0.0;
    for (int i = 0; i < 6000 && (i < 20 || !t.sling().tied); ++i)
      t.step(), fastest = std::max(fastest, specimen::fastestKnot(t.world));
    ASSERT_TRUE(t.sling().tied);
    EXPECT_LT(fastest, 2.0) << "m/s, at x = " << x;
    t.input.tools[0].present = false;
    t.run(2000);
    EXPECT_LT(specimen::fastestKnot(t.world), 0.001) << "m/s, held";
  }
}

TEST(Sling, HoldsWhereItWasTiedWhileTheOrganIsPulled) {
  Theatre t;
  const double whole = t.section(12);
  t.applicator(0.0, true);
  for (int i = 0; i < 6000 && (i < 20 || !t.sling().tied); ++i) t.step();
  ASSERT_TRUE(t.sling().tied);
  t.input.tools[0].present = false;
  t.run(1000);
  const double length = lengthOf(t.sling());
  // A grasper takes the tube beside the loop and pulls it along and up.
  auto& g = t.input.tools[1];
  g = specimen::grasper(Vector3d(0.015, 0, 0.046), 1.0);
  t.run(30);
  for (int i = 0; i < 200; ++i) g.jaw = std::max(0.0, g.jaw - 0.01), t.step();
  const Vector3d before = t.sling().knot;
  for (int i = 0; i < 400; ++i) g.position += Vector3d(2e-5, 0, 2e-5), t.step();
  t.run(300);
  const bool grasped = std::any_of(t.events.begin(), t.events.end(),
                                   [](const auto& e) { return e.kind == scene::EventKind::Grasped; });
  ASSERT_TRUE(grasped);
  EXPECT_GT((t.sling().knot - before).norm(), 5e-4) << "it goes with the organ";
  const auto positions = t.sling().positions;
  EXPECT_LT(interaction::polygonArea(positions.data(), static_cast<int>(positions.size())), 0.25 * whole)
      << "still tied off";
  EXPECT_NEAR(lengthOf(t.sling()), length, 0.02 * length);
  EXPECT_LT(t.sling().tension, 20.1);
}

// Protects against a second loop that hung loose at the applicator, and could be laid, after the first was
// tied.
TEST(Sling, AnApplicatorCarriesOneLoopUntilItIsExchanged) {
  Theatre t;
  const auto count = [&] {
    std::vector<scene::SlingView> all;
    t.world.slings(all);
    return all.size();
  };
  t.applicator(0.0, true);
  for (int i = 0; i < 6000 && (i < 20 || !t.sling().tied); ++i) t.step();
  ASSERT_TRUE(t.sling().tied);
  t.run(20);
  EXPECT_EQ(count(), 1u) << "still drawn";
  t.applicator(0.0, false);
  t.run(20);
  EXPECT_EQ(count(), 1u) << "let go";
  t.applicator(0.010, true);
  t.run(20);
  EXPECT_EQ(count(), 1u) << "drawn again";
  t.input.tools[0].present = false;
  t.run(2);
  t.applicator(0.010, false);
  t.run(2);
  EXPECT_EQ(count(), 2u) << "another applicator";
}

/// Linear and angular momentum of the tube.
void momenta(Theatre& t, const scene::Description& d, Vector3d& linear, Vector3d& angular) {
  std::vector<float> v(3 * t.world.knotCount(0)), p(v.size());
  t.world.velocities(0, v.data());
  t.world.positions(0, p.data());
  linear.setZero(), angular.setZero();
  for (std::size_t i = 0; 3 * i < p.size(); ++i) {
    const Vector3d u = d.objects[0].mass[i] * Vector3d(v[3 * i], v[3 * i + 1], v[3 * i + 2]);
    linear += u;
    angular += Vector3d(p[3 * i], p[3 * i + 1], p[3 * i + 2]).cross(u);
  }
}

// Protects against a loop that pulls on tissue from nowhere: what the tissue gets the applicator loses.
TEST(Sling, PutsNoForceOnTheTissueButThatOfItsApplicator) {
  const scene::Description d = stump(false);
  Theatre t(d);
  t.applicator(0.0, false);
  t.run(20);
  Vector3d l0, a0, l1, a1;
  momenta(t, d, l0, a0);
  t.applicator(0.0, true);
  double most = 0.0;
  Vector3d pushed = Vector3d::Zero();
  for (int i = 0; i < 1500; ++i) {
    t.step(), most = std::max(most, t.sling().tension);
    pushed -= 0.001 * t.report.contacts[0].wrench.head<3>();
  }
  ASSERT_GT(most, 0.01);
  momenta(t, d, l1, a1);
  EXPECT_LT((l1 - l0 - pushed).norm(), 1e-5 * most * 1.5);
}

// A tied loop has nothing to push against: a free tube that is damped comes to rest under it and stays there.
TEST(Sling, PutsNoNetForceAndNoNetTorqueOnTheTissueOnceItIsTied) {
  scene::Description d = stump(false);
  const double rate = 20.0;  // 1/s
  for (std::size_t i = 0; i < d.objects[0].mass.size(); ++i)
    d.objects[0].damping[i] = rate * d.objects[0].mass[i];
  Theatre t(d);
  t.applicator(0.0, true);
  for (int i = 0; i < 3000 && (i < 20 || !t.sling().tied); ++i) {
    // The pusher goes down with the loop, as a hand does it.
    if (i > 0)
      t.input.tools[0].position.z() = 0.05 + 0.0112 + std::max(t.sling().rest_length / (2 * M_PI), 0.0045);
    t.step();
  }
  ASSERT_TRUE(t.sling().tied);
  t.input.tools[0].present = false;
  t.run(2000);
  Vector3d l, a;
  momenta(t, d, l, a);
  const double tension = t.sling().tension;
  ASSERT_GT(tension, 0.01);
  EXPECT_LT(rate * l.norm(), 1e-5 * tension) << "N: what would keep it moving against its damping";
  EXPECT_LT(rate * a.norm(), 1e-5 * tension * 0.01) << "N·m";
}

TEST(Sling, WithNothingInItClosesAndOpensAgain) {
  Theatre t;
  t.applicator(0.2, false);
  t.run(10);
  t.applicator(0.2, true);
  t.run(500);
  EXPECT_FALSE(t.sling().around);
  EXPECT_LT(t.sling().rest_length, 0.07);
  const double drawn = t.sling().rest_length;
  EXPECT_NEAR(lengthOf(t.sling()), drawn, 0.01 * drawn);
  t.applicator(0.2, false);
  t.run(100);
  EXPECT_NEAR(t.sling().rest_length, drawn * std::exp(1.2 * 0.1), 1e-9) << "it dilates as it was drawn";
  t.run(500);
  EXPECT_EQ(t.sling().rest_length, 0.120);
  EXPECT_LT(worstLink(t.sling()), 1e-3);
  t.input.tools[0].present = false;
  t.run(1);
  std::vector<scene::SlingView> all;
  t.world.slings(all);
  EXPECT_TRUE(all.empty()) << "it leaves with its applicator";
}

TEST(Sling, HashesAreTheSameForAnyThreadsAndAfterRestore) {
  const auto hash = [](int threads, bool restored) {
    Theatre t(stump(), threads);
    t.applicator(0.0, false);
    t.run(10);
    t.applicator(0.0, true);
    t.run(1500);
    if (restored) {
      std::vector<std::uint8_t> bytes;
      t.world.save(bytes);
      scene::World other(stump(), threads);
      other.restore(bytes);
      t.world = std::move(other);
    }
    t.run(1000);
    return t.world.stateHash();
  };
  const auto reference = hash(1, false);
  EXPECT_EQ(hash(2, false), reference);
  EXPECT_EQ(hash(4, false), reference);
  EXPECT_EQ(hash(2, true), reference);
}

}  // namespace
