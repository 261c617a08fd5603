// A tube that was cut has two walls at one ring: clips, slings, coagulation and motility take the one they
// are at, whose knots may be copies.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "theatre.h"
#include "vest_tissue/scene/topology.h"
#include "vest_tissue/scene/world_model.h"

namespace {

using namespace vest;
using Eigen::Vector3d;

constexpr int kRings = 24, kAround = 8, kRing = 12;
constexpr std::uint32_t kKnots = kRings * kAround;
constexpr double kLength = 0.07, kCut = kLength * (double(kRing) / (kRings - 1) - 0.5);  // m: x of that ring

scene::Description tube(double radius, bool held = true) {
  specimen::TubeOptions o;
  o.radius = radius, o.rings = kRings, o.around = kAround, o.length = kLength, o.mass = 0.002,
  o.fix_ends = held;
  scene::Description d = specimen::tubeScene(o);
  d.gravity.setZero();
  return d;
}

struct Theatre : test::Theatre {
  /// Cut through at one ring: the wall towards +x hangs on copies.
  explicit Theatre(const scene::Description& d) : test::Theatre(d) {
    for (std::uint32_t i = 0; i < kAround; ++i)
      input.requests.push_back(
          {scene::TopologyRequest::Kind::SplitKnot, 0, kRing * kAround + i, Vector3d::UnitX()});
    step();
    input.requests.clear();
    EXPECT_EQ(world.knotCount(0), kKnots + kAround);
  }
  /// Mean distance of a ring's knots, or of its copies, from their middle, m.
  double radius(bool copies) const {
    Vector3d middle = Vector3d::Zero();
    const auto at = [&](int i) { return world.knotAt(0, copies ? kKnots + i : kRing * kAround + i); };
    for (int i = 0; i < kAround; ++i) middle += at(i) / kAround;
    double sum = 0.0;
    for (int i = 0; i < kAround; ++i) sum += (at(i) - middle).norm() / kAround;
    return sum;
  }
};

TEST(CutRings, AClipClosesTheStumpThatItIsOn) {
  for (const bool above : {true, false}) {
    Theatre t(tube(0.0025));
    const Vector3d tip(kCut + (above ? 0.0008 : -0.0008), 0, 0.0435);
    t.use(tools::ToolKind::ClipApplier, tip, 0.6, 0.6, 60);
    t.use(tools::ToolKind::ClipApplier, tip, 0.6, 0.0, 300);
    ASSERT_EQ(t.world.state().fasteners.clips.size(), 1u);
    const auto& clip = t.world.state().fasteners.clips[0];
    ASSERT_TRUE(clip.alive);
    ASSERT_EQ(clip.ring, kAround) << "around the lumen";
    for (int i = 0; i < clip.ring; ++i) {
      EXPECT_EQ(clip.knots[i] >= kKnots, above) << "knot " << clip.knots[i];
      EXPECT_EQ(scene::originalKnot(t.world.topology(0), kKnots, clip.knots[i]) / kAround,
                std::uint32_t{kRing});
    }
    t.run(300);
    EXPECT_LT(t.radius(above), t.radius(!above)) << "the other stump stays open";
  }
}

TEST(CutRings, ASlingLiesOnTheStumpThatItIsAround) {
  for (const bool above : {true, false}) {
    Theatre t(tube(0.004));
    const Vector3d tip(kCut + (above ? 0.0012 : -0.0012), 0, 0.05 + 0.0112 + 0.019);
    t.use(tools::ToolKind::SlingApplicator, tip, 0.0, 0.0, 50);
    t.use(tools::ToolKind::SlingApplicator, tip, 0.0, 0.0, 500, tools::kFunctionFire);
    ASSERT_EQ(t.world.state().fasteners.slings.size(), 1u);
    const auto& sling = t.world.state().fasteners.slings[0];
    ASSERT_TRUE(sling.around);
    ASSERT_EQ(sling.ring, kRing);
    ASSERT_EQ(sling.count, kAround);
    for (int i = 0; i < sling.count; ++i)
      EXPECT_EQ(sling.knots[i] >= kKnots, above) << "knot " << sling.knots[i];
    EXPECT_NEAR(sling.area, 0.5 * kAround * std::sin(2 * M_PI / kAround) * 0.004 * 0.004, 1e-9)
        << "m², at rest";
  }
}

/// A ring with more knots than a sling has room for is closed where a cut has left few enough of them. All of
/// the scene's ring were written into it then, over the length of the thread.
TEST(CutRings, ASlingClosesWhatACutLeftOfARingThatIsTooLargeForIt) {
  constexpr int kMany = 40, kLeft = 24;
  static_assert(kMany > interaction::kMaxSlingKnots && kLeft <= interaction::kMaxSlingKnots);
  specimen::TubeOptions o;
  o.radius = 0.004, o.rings = kRings, o.around = kMany, o.length = kLength;
  o.mass = 0.2, o.youngs_modulus = 1e3;  // heavy and soft: few sub-steps
  scene::Description d = specimen::tubeScene(o);
  d.gravity.setZero();
  // Without its wall on one side of the tube, but for the rings at both ends.
  auto& triangles = d.objects[0].contact_triangles;
  triangles.erase(std::remove_if(triangles.begin(), triangles.end(),
                                 [](const auto& t) {
                                   return std::all_of(t.begin(), t.end(), [](std::uint32_t knot) {
                                     return knot / kMany > 0 && knot / kMany + 1 < kRings &&
                                            knot % kMany >= kLeft - 1;
                                   });
                                 }),
                  triangles.end());
  test::Theatre t(d);
  t.input.requests.push_back(
      {scene::TopologyRequest::Kind::SplitKnot, 0, (kRing - 4) * kMany + 3, Vector3d::UnitX()});
  t.step();
  t.input.requests.clear();
  ASSERT_EQ(t.world.knotCount(0), std::size_t{kRings * kMany + 1});
  const Vector3d tip(kCut, 0, 0.05 + 0.0112 + 0.019);
  t.use(tools::ToolKind::SlingApplicator, tip, 0.0, 0.0, 5);
  constexpr int kDrawn = 30;
  t.use(tools::ToolKind::SlingApplicator, tip, 0.0, 0.0, kDrawn, tools::kFunctionFire);
  ASSERT_EQ(t.world.state().fasteners.slings.size(), 1u);
  const auto& sling = t.world.state().fasteners.slings[0];
  ASSERT_TRUE(sling.around);
  ASSERT_NEAR(sling.ring, kRing, 1);
  EXPECT_LE(sling.count, interaction::kMaxSlingKnots);
  EXPECT_GE(sling.count, kLeft - 1);
  for (int i = 0; i < sling.count; ++i) EXPECT_EQ(int(sling.knots[i]) / kMany, sling.ring);
  EXPECT_NEAR(sling.rest, 0.120 * std::exp(-1.2 * 0.001 * kDrawn), 1e-9) << "m of thread";
  EXPECT_GT(sling.area, 0.0);
  EXPECT_LT(sling.area, M_PI * o.radius * o.radius) << "m²: of what is left";
}

TEST(CutRings, ForcepsSealTheStumpThatTheyHold) {
  Theatre t(tube(0.004));
  const double x = kCut + 0.003;
  t.use(tools::ToolKind::BipolarForceps, Vector3d(x, 0, 0.042), 0.87, 0.87, 50);
  t.use(tools::ToolKind::BipolarForceps, Vector3d(x, 0, 0.042), 0.87, 0.05, 400);
  for (int i = 0; i < 40 && t.radius(true) > 0.0; ++i) {
    t.use(tools::ToolKind::BipolarForceps, Vector3d(x, 0, 0.042), 0.05, 0.05, 200, tools::kFunctionCoagulate);
    const bool sealed = std::any_of(t.events.begin(), t.events.end(), [](const scene::Event& e) {
      return e.kind == scene::EventKind::Coagulated && e.area == 0.0 && e.element >= kKnots;
    });
    if (sealed) return;
  }
  FAIL() << "the copies are denatured all around, and nobody says that their stump is closed";
}

TEST(CutRings, BothStumpsMoveByThemselvesAndDoNotPullAtEachOther) {
  motility::Motility m;
  m.waves[0] = {100.0, 0.0, 2.0, 1.0, 1.0, 0.0};
  m.ramp = 0.2;
  scene::Description d = tube(0.01, false);
  d.objects[0].law.youngs_modulus = 10e3;
  for (auto& g : d.objects[0].damping) g = 0.0;
  d.objects[0].motility = m;
  Theatre t(d);
  double least[2] = {1.0, 1.0}, most[2] = {0.0, 0.0};
  for (int i = 0; i < 1500; ++i) {
    t.step();
    for (const bool copies : {false, true}) {
      const double r = t.radius(copies);
      least[copies] = std::min(least[copies], r), most[copies] = std::max(most[copies], r);
    }
  }
  EXPECT_GT(most[0] - least[0], 1e-5) << "m";
  // The links around the ring have stayed with the scene's knots. With its part of the muscle the other wall
  // gives way more.
  EXPECT_GT(most[1] - least[1], 1.5 * (most[0] - least[0]));
  const scene::ObjectState& s = t.world.state().objects[0];
  Vector3d momentum = Vector3d::Zero();
  double sum = 0.0;
  for (std::size_t k = 0; k < s.block.knots(); ++k) {
    const Vector3d v(s.block.row(net::Block::VX)[k], s.block.row(net::Block::VY)[k],
                     s.block.row(net::Block::VZ)[k]);
    momentum += s.block.row(net::Block::kMass)[k] * v;
    sum += s.block.row(net::Block::kMass)[k] * v.norm();
  }
  EXPECT_LT(momentum.norm(), 1e-3 * sum);
}

}  // namespace
