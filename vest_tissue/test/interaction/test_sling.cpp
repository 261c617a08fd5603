#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "nets.h"
#include "vest_tissue/interaction/clip.h"
#include "vest_tissue/scene/world.h"

namespace {

using namespace vest;
using Eigen::Vector3d;

scene::Description stump(bool held = true) {
  test::TubeOptions o;
  o.radius = 0.004, o.rings = 24, o.length = 0.07, o.mass = 0.002, o.fix_ends = held;
  scene::Description d = test::tubeScene(o);
  d.gravity.setZero();
  if (!held)
    for (auto& g : d.objects[0].damping) g = 0.0;
  return d;
}

struct Theatre {
  scene::World world;
  scene::StepInput input;
  scene::StepReport report;
  std::vector<scene::Event> events;

  explicit Theatre(const scene::Description& d = stump(), int threads = 1) : world(d, threads) {}
  void step() {
    input.step = world.steps();
    ASSERT_NE(world.step(input, report), scene::Status::Fault);
    events.insert(events.end(), report.events.begin(), report.events.end());
  }
  void run(int steps) {
    for (int i = 0; i < steps; ++i) step();
  }
  /// The applicator from above; its loop hangs around the tube at x (the tool's x axis lies along y).
  void applicator(double x, bool draw) {
    auto& t = input.tools[0];
    t = test::grasper(Vector3d(x, 0, 0.05 + 0.0112 + 0.019), 0.0);
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

TEST(Sling, HangsOpenAtItsApplicatorAndShortensByTheSameLawForAnyStep) {
  double rest[2];
  for (int n = 0; n < 2; ++n) {
    Theatre t;
    t.input.dt = n == 0 ? 0.001 : 0.0005;
    t.applicator(0.0, false);
    t.run(n == 0 ? 50 : 100);
    EXPECT_EQ(t.sling().rest_length, 0.120);
    EXPECT_NEAR(lengthOf(t.sling()), 0.120, 0.001) << "drawn as long as it is";
    EXPECT_NEAR((t.sling().knot - Vector3d(0, 0, 0.069)).norm(), 0.0, 0.001) << "at the pusher's end";
    t.applicator(0.0, true);
    t.run(n == 0 ? 500 : 1000);
    rest[n] = t.sling().rest_length;
    EXPECT_TRUE(t.sling().around);
  }
  EXPECT_NEAR(rest[0], 0.120 * std::exp(-1.2 * 0.5), 1e-9);
  EXPECT_NEAR(rest[1], rest[0], 1e-9);
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

TEST(Sling, PutsNoNetForceAndNoNetTorqueOnTheTissue) {
  const scene::Description d = stump(false);
  Theatre t(d);
  t.applicator(0.0, false);
  t.run(20);
  const auto momenta = [&](Vector3d& linear, Vector3d& angular) {
    std::vector<float> v(3 * t.world.knotCount(0)), p(v.size());
    t.world.velocities(0, v.data());
    t.world.positions(0, p.data());
    linear.setZero(), angular.setZero();
    for (std::size_t i = 0; 3 * i < p.size(); ++i) {
      const Vector3d u = d.objects[0].mass[i] * Vector3d(v[3 * i], v[3 * i + 1], v[3 * i + 2]);
      linear += u;
      angular += Vector3d(p[3 * i], p[3 * i + 1], p[3 * i + 2]).cross(u);
    }
  };
  Vector3d l0, a0, l1, a1;
  momenta(l0, a0);
  t.applicator(0.0, true);
  double most = 0.0;
  for (int i = 0; i < 4000; ++i) t.step(), most = std::max(most, t.sling().tension);
  ASSERT_GT(most, 1e-3);
  momenta(l1, a1);
  EXPECT_LT((l1 - l0).norm(), 1e-5 * most * 4.0);
  EXPECT_LT((a1 - a0).norm(), 1e-5 * most * 0.01 * 4.0);
}

TEST(Sling, WithNothingInItClosesAndOpensAgain) {
  Theatre t;
  t.applicator(0.2, false);
  t.run(10);
  t.applicator(0.2, true);
  t.run(500);
  EXPECT_FALSE(t.sling().around);
  EXPECT_LT(t.sling().rest_length, 0.07);
  t.applicator(0.2, false);
  t.run(1);
  EXPECT_EQ(t.sling().rest_length, 0.120);
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
