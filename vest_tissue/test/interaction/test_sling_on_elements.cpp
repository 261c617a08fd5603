// A ligation sling on finite elements: it does there what it does on nets.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "blades.h"
#include "slab.h"
#include "theatre.h"
#include "vest_tissue/interaction/clip.h"
#include "vest_tissue/interaction/sling.h"
#include "vest_tissue/scene/world_model.h"

namespace {

using namespace vest;
using Eigen::Vector3d;
using fem::Motion;
using fem::Strain;

struct Kind {
  Motion motion;
  Strain strain;
};
constexpr Kind kKinds[] = {{Motion::BackwardEuler, Strain::Small},
                           {Motion::BackwardEuler, Strain::Corotational},
                           {Motion::Elastostatic, Strain::Small}};

struct BarOptions {
  Kind kind = kKinds[0];
  bool held = true;
  double youngs_modulus = 5000.0;  // Pa
  double damping = 2.0;            // 1/s, rayleigh_mass
};

/// A round bar along x, 48 mm long, 7 mm thick; its ends are held or free.
scene::Description bar(const BarOptions& o) {
  constexpr double kLength = 0.048, kSide = 0.007;
  fem::Description d = fem::specimen::makeBox({16, 3, 3, kLength, kSide, kSide}, false);
  d.name = "bar";
  d.motion = o.kind.motion, d.strain = o.kind.strain;
  d.material = {o.youngs_modulus, 0.4, 1050.0, o.damping, 0.004};
  for (fem::Index n = 0; n < d.nodes.size(); ++n) {
    Vector3d& x = d.nodes[n];
    if (o.held && (x.x() == 0.0 || x.x() > kLength - 1e-9)) d.fixed.push_back(n);
    x -= Vector3d(0.5 * kLength, 0.5 * kSide, 0.5 * kSide);
    // Squares become circles.
    const double side = std::max(std::fabs(x.y()), std::fabs(x.z())), radius = std::hypot(x.y(), x.z());
    if (radius > 0.0) x.y() *= side / radius, x.z() *= side / radius;
    x.z() += 0.05;
  }
  scene::Description s = fem::specimen::sceneOf({fem::specimen::object(d)});
  s.gravity.setZero();
  return s;
}

struct Theatre : test::Theatre {
  explicit Theatre(const scene::Description& d, int threads = 1) : test::Theatre(d, threads) {
    worst = scene::Status::Ok;
  }
  const interaction::Sling& loop() const { return world.state().fasteners.slings.at(0); }
  bool hasLoop() const { return !world.state().fasteners.slings.empty() && loop().alive; }
  /// The applicator from above, its loop around the bar at x; the pusher goes down with it, as a hand does.
  void applicator(double x, bool draw) {
    constexpr double kPusher = 0.0112, kRadius = 0.0042;  // m: of its end from the tip; of the bar and more
    auto& t = input.tools[0];
    const double rest = hasLoop() ? loop().rest : interaction::kSlingLength;
    t = specimen::grasper(Vector3d(x, 0, 0.05 + kPusher + std::max(rest / (2 * M_PI), kRadius)), 0.0);
    t.tool = tools::ToolKind::SlingApplicator;
    t.pivot = Vector3d(x, 0, 0.2);
    if (draw) t.functions = tools::kFunctionFire;
  }
  /// Draws until the loop is tied. `each`: after every step.
  template <typename Each>
  void tie(Each each) {
    for (int i = 0; i < 4000 && !testing::Test::HasFatalFailure(); ++i) {
      applicator(0.0, true);
      step();
      each();
      if (loop().tied) return;
    }
  }
  void tie() {
    tie([] {});
  }
  void leave() { input.tools[0].present = false; }
  /// Cross-section of the bar under the loop, m²: within the places that it lies on.
  double section() const {
    std::vector<Vector3d> p;
    const auto& s = world.state().objects[0];
    for (const auto& t : loop().touch) {
      if (!t.on) continue;
      p.emplace_back(Vector3d::Zero());
      for (int e = 0; e < 3; ++e) p.back() += t.weights[e] * s.tissue.x[t.knots[e]];
    }
    return interaction::polygonArea(p.data(), static_cast<int>(p.size()));
  }
  Vector3d momentum() const {
    Vector3d sum = Vector3d::Zero();
    const auto& s = world.state().objects[0].tissue;
    for (std::size_t k = 0; k < s.x.size(); ++k) sum += s.mass[k] * s.v[k];
    return sum;
  }
  Vector3d spin() const {
    Vector3d sum = Vector3d::Zero();
    const auto& s = world.state().objects[0].tissue;
    for (std::size_t k = 0; k < s.x.size(); ++k) sum += s.mass[k] * s.x[k].cross(s.v[k]);
    return sum;
  }
  Vector3d middle() const {
    Vector3d sum = Vector3d::Zero();
    double mass = 0.0;
    const auto& s = world.state().objects[0].tissue;
    for (std::size_t k = 0; k < s.x.size(); ++k) sum += s.mass[k] * s.x[k], mass += s.mass[k];
    return sum / mass;
  }
  double fastest() const {
    double most = 0.0;
    for (const Vector3d& v : world.state().objects[0].tissue.v) most = std::max(most, v.norm());
    return most;
  }
};

std::string nameOf(const Kind& kind) {
  return std::to_string(int(kind.motion)) + std::to_string(int(kind.strain));
}

TEST(SlingOnElements, DrawsTheBarInAsTheThreadShortensTellsItAndHoldsWithoutItsApplicator) {
  for (const Kind& kind : kKinds) {
    BarOptions o;
    o.kind = kind;
    Theatre t(bar(o));
    double longest = 0.0, most = 0.0;
    t.tie([&] {
      const interaction::Sling& s = t.loop();
      if (!s.around) return;
      most = std::max(most, s.tension);
      // Where the thread lies it is no longer than it is: of the way over its places, and the pusher's leg.
      double way = 0.0;
      for (int i = 0; i < interaction::kSlingNodes; ++i)
        way += (s.node[(i + 1) % interaction::kSlingNodes] - s.node[i]).norm();
      if (s.tension > 0.0) longest = std::max(longest, way / s.rest);
    });
    ASSERT_FALSE(HasFatalFailure());
    ASSERT_TRUE(t.loop().tied) << nameOf(kind);
    EXPECT_LT(longest, 1.03) << "drawn in as the thread is, but for what nodes cut from corners";
    EXPECT_GT(most, 0.01) << "N";
    EXPECT_LT(most, interaction::kSlingTension);
    const double tied = t.section();
    const scene::Event* e = nullptr;
    for (const auto& x : t.events)
      if (x.kind == scene::EventKind::Ligated) e = &x;
    ASSERT_NE(e, nullptr);
    EXPECT_EQ(e->object, 0);
    EXPECT_EQ(e->instrument, 0);
    EXPECT_TRUE(std::isnan(e->station)) << "no tube's";
    EXPECT_GT(e->force, 0.0);
    const double radius = 0.0035 + interaction::kSlingRadius;  // m: of the thread around the bar
    EXPECT_NEAR(e->area, M_PI * radius * radius, 0.1 * M_PI * radius * radius)
        << "m²: of a polygon, when it was first taut to 2 %";
    EXPECT_LT(tied, 0.5 * e->area) << "m²: drawn in, " << nameOf(kind);
    t.leave();
    t.run(1000);
    const double rest = t.loop().rest, section = t.section();
    const Vector3d place = t.loop().node[16];
    t.run(1000);
    EXPECT_EQ(t.loop().rest, rest) << "the knot holds";
    EXPECT_NEAR(t.section(), section, 0.005 * section);
    EXPECT_LT((t.loop().node[16] - place).norm(), 5e-5) << "m: it stays where it is";
    EXPECT_LT(t.fastest(), 1e-3) << "m/s: and comes to rest, " << nameOf(kind);
    EXPECT_GT(t.loop().tension, 0.01) << "N: the bar presses against it";
    std::vector<scene::Attachment> attachments;
    t.world.attachments(attachments);
    ASSERT_EQ(attachments.size(), 1u);
    EXPECT_EQ(attachments[0].kind, 2);
  }
}

// Protects against a thread that pulls on elements from nowhere: what they get the applicator loses, and a
// tied loop has nothing to push against.
TEST(SlingOnElements, PutsNoForceOnTheTissueButThatOfItsApplicator) {
  for (const Strain strain : {Strain::Small, Strain::Corotational}) {
    BarOptions o;
    o.kind = {Motion::BackwardEuler, strain};
    o.held = false, o.damping = 0.0;
    Theatre t(bar(o));
    Vector3d pushed = Vector3d::Zero();
    double impulse = 0.0;  // N·s: of the tension
    t.tie([&] {
      pushed -= 0.001 * t.report.contacts[0].wrench.head<3>();
      impulse += 0.001 * t.loop().tension;
    });
    ASSERT_FALSE(HasFatalFailure());
    ASSERT_TRUE(t.loop().tied);
    ASSERT_GT(impulse, 1e-3);
    EXPECT_LT((t.momentum() - pushed).norm(), 1e-4 * impulse) << "N·s";
  }
}

// A free bar that is damped comes to rest under a tied loop and stays there: it has nothing to push against.
TEST(SlingOnElements, PutsNoNetForceAndNoNetTorqueOnTheTissueOnceItIsTied) {
  for (const Strain strain : {Strain::Small, Strain::Corotational}) {
    BarOptions o;
    o.kind = {Motion::BackwardEuler, strain};
    o.held = false, o.damping = 20.0;
    Theatre t(bar(o));
    t.tie();
    ASSERT_FALSE(HasFatalFailure());
    ASSERT_TRUE(t.loop().tied);
    t.leave();
    t.run(1500);
    ASSERT_GT(t.loop().tension, 0.01) << "N";
    EXPECT_LT(o.damping * t.momentum().norm(), 1e-5 * t.loop().tension)
        << "N: what would keep it moving against its damping";
    // Small strain does not know that a body turns: deformed and free, its own forces have a moment.
    if (strain == Strain::Small) continue;
    // The answers that the links' directions are found with are approximate for elements that turn.
    EXPECT_LT(o.damping * (t.spin() - t.middle().cross(t.momentum())).norm(),
              1e-2 * t.loop().tension * 0.0035)
        << "N·m, on an arm of the bar's radius";
  }
}

// A thread of the hand's greatest tension around a hard bar: it slips through its knot and crushes nothing.
TEST(SlingOnElements, DrawsNoHarderThanAHandAndLeavesWithItsApplicatorWhereItCouldNotBeTied) {
  BarOptions o;
  o.youngs_modulus = 20e6;
  Theatre t(bar(o));
  double most = 0.0;
  t.tie([&] { most = std::max(most, t.loop().tension); });
  ASSERT_FALSE(HasFatalFailure());
  EXPECT_FALSE(t.loop().tied);
  EXPECT_GT(most, 0.8 * interaction::kSlingTension);
  EXPECT_LE(most, interaction::kSlingTension * (1.0 + 1e-9));
  EXPECT_GT(t.loop().rest, 0.018) << "m: l0 ends where the bar ends it";
  t.leave();
  t.run(300);
  EXPECT_FALSE(t.hasLoop());
  EXPECT_LT(t.fastest(), 1e-3);
}

TEST(SlingOnElements, HashesAreTheSameForAnyThreadsAndAfterRestore) {
  for (const Kind& kind : kKinds) {
    BarOptions o;
    o.kind = kind;
    const scene::Description d = bar(o);
    const auto hash = [&](int threads, bool restored) {
      Theatre t(d, threads);
      for (int i = 0; i < 1500; ++i) t.applicator(0.0, true), t.step();
      EXPECT_TRUE(t.loop().around);
      EXPECT_GT(t.loop().tension, 0.0);
      if (restored) {
        std::vector<std::uint8_t> bytes;
        t.world.save(bytes);
        scene::World other(d, threads);
        other.restore(bytes);
        t.world = std::move(other);
      }
      for (int i = 0; i < 600; ++i) {
        t.loop().tied ? t.leave() : t.applicator(0.0, true);
        t.step();
      }
      return t.world.stateHash();
    };
    const auto reference = hash(1, false);
    EXPECT_EQ(hash(2, false), reference) << nameOf(kind);
    EXPECT_EQ(hash(4, false), reference) << nameOf(kind);
    EXPECT_EQ(hash(2, true), reference) << nameOf(kind);
  }
}

// A loop that is tied holds while the bar is pulled, and where it is cut beside the loop.
TEST(SlingOnElements, HoldsWhileTheBarIsPulledAndCutBesideIt) {
  for (const Kind& kind : kKinds) {
    BarOptions o;
    o.kind = kind;
    Theatre t(bar(o));
    t.tie();
    ASSERT_TRUE(t.loop().tied);
    t.leave();
    t.run(300);
    const double section = t.section();
    auto& g = t.input.tools[1];
    g = specimen::grasper(Vector3d(0.012, 0, 0.046), 1.0);
    t.run(30);
    for (int i = 0; i < 200; ++i) g.jaw = std::max(0.0, g.jaw - 0.01), t.step();
    const Vector3d before = t.loop().node[16];
    for (int i = 0; i < 300; ++i) g.position += Vector3d(1e-5, 0, 1.5e-5), t.step();
    t.run(200);
    EXPECT_GT((t.loop().node[16] - before).norm(), 3e-4) << "m: it goes with the bar, " << nameOf(kind);
    EXPECT_LT(t.section(), 1.1 * section);
    g.present = false;
    // Scissors 9 mm beside it.
    for (int i = 0; i < 260; ++i) {
      const double come = std::min(1.0, i / 60.0), close = std::clamp((i - 60.0) / 120.0, 0.0, 1.0);
      g = specimen::toolAt(tools::ToolKind::Scissors, Vector3d(-0.009, 0, 0.060 - 0.014 * come),
                           Vector3d(0, 0, -1), Vector3d(0, 1, 0), 0.9 * (1.0 - close));
      t.input.step = t.world.steps();
      ASSERT_NE(t.world.step(t.input, t.report), scene::Status::Fault);
      t.events.insert(t.events.end(), t.report.events.begin(), t.report.events.end());
    }
    g.present = false;
    t.run(250);
    const auto cuts = std::count_if(t.events.begin(), t.events.end(),
                                    [](const auto& e) { return e.kind == scene::EventKind::Cut; });
    EXPECT_GE(cuts, 1) << nameOf(kind);
    EXPECT_LT(t.section(), 1.1 * section) << nameOf(kind);
    EXPECT_LT(t.fastest(), 0.02) << "m/s";
  }
}

// Protects the station of a ligature on a vessel of elements: the vessel network closes there.
TEST(SlingOnElements, ALigatureOnAVesselOfElementsHasAStation) {
  scene::Description d = bar({});
  scene::Object& o = d.objects[0];
  o.tube.vessel_segment = "artery";
  for (int r = 0; r <= 16; ++r) {  // the bar's sections
    o.tube.station.push_back(0.003 * r);
    o.tube.rings.emplace_back();
    for (std::uint32_t k = 0; k < o.rest_position.size(); ++k)
      if (std::fabs(o.rest_position[k].x() + 0.024 - 0.003 * r) < 1e-6) o.tube.rings.back().push_back(k);
  }
  Theatre t(d);
  t.tie();
  ASSERT_FALSE(HasFatalFailure());
  ASSERT_TRUE(t.saw(scene::EventKind::Ligated));
  for (const auto& e : t.events)
    if (e.kind == scene::EventKind::Ligated) {
      EXPECT_NEAR(e.station, 0.024, 0.0015) << "m: the middle";
    }
  EXPECT_NEAR(t.loop().station, 0.024, 0.0015);
  // Elsewhere nothing is told of a vessel.
  Theatre plain(bar({}));
  plain.tie();
  EXPECT_TRUE(std::isnan(plain.loop().station));
}

// Protects against a loop that a cut leaves hanging between two pieces: each node goes with its own side.
TEST(SlingOnElements, EachNodeGoesWithItsSideOfACut) {
  Theatre t(bar({}));
  t.tie();
  ASSERT_FALSE(HasFatalFailure());
  t.leave();
  t.run(100);
  t.use(tools::ToolKind::Scissors, Vector3d(0.0005, 0, 0.045), 0.9, 0.0, 120);
  t.test::Theatre::leave();
  ASSERT_TRUE(t.saw(scene::EventKind::Cut));
  t.run(200);
  const scene::ObjectState& s = t.world.state().objects[0];
  ASSERT_FALSE(s.topology.doubled_knots.empty());
  int on = 0;
  for (const auto& touch : t.loop().touch) {
    if (!touch.on) continue;
    ++on;
    EXPECT_NE(std::find(s.triangles.begin(), s.triangles.end(), touch.knots), s.triangles.end())
        << "no triangle of the surface: its corners lie on both sides";
  }
  EXPECT_GT(on, 8);
}

}  // namespace
