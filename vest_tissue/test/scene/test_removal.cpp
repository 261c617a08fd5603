#include <gtest/gtest.h>

#include "blades.h"
#include "vest_tissue/base/sunken_wall.h"
#include "vest_tissue/scene/loose.h"

// Protects that tissue leaves the cavity by a trocar alone: jaws draw a loose part out through the wall that
// their shaft enters by, and the World tells how much is out. What still hangs on something never counts.
// Protects, too, that tissue, threads and instruments meet a wall that has sunk for want of gas where it
// hangs.

namespace {

using namespace vest;
using Eigen::Vector3d;

constexpr double kRoof = 0.10;  // m

/// A bar of 20 × 4 × 4 mm in a box of 0.2 × 0.2 × 0.1 m, seen from within.
scene::Description inABox(bool held) {
  specimen::BarOptions o;
  o.columns = 6, o.rows = 2;
  o.mass = 0.0005;
  o.fix_left = held, o.fix_right = false;
  scene::Description d = specimen::barScene(o);
  d.gravity.setZero();
  scene::Object box;
  box.name = box.organ = "cavity";
  box.model = scene::ObjectModel::Rigid;
  for (int i = 0; i < 8; ++i)
    box.position.emplace_back(i & 1 ? 0.1 : -0.1, i & 2 ? 0.1 : -0.1, i & 4 ? kRoof : 0.0);
  box.contact_triangles = {{0, 1, 3}, {0, 3, 2}, {4, 6, 7}, {4, 7, 5}, {0, 4, 5}, {0, 5, 1},
                           {2, 3, 7}, {2, 7, 6}, {0, 2, 6}, {0, 6, 4}, {1, 5, 7}, {1, 7, 3}};
  d.objects.push_back(box);
  return d;
}

/// A grasper that takes the bar's end and draws it straight up.
struct Removal {
  scene::World world;
  scene::StepInput in;
  scene::StepReport report;
  Vector3d pivot{0.008, 0, kRoof + 0.04};

  explicit Removal(bool held) : world(inABox(held)) {}

  void move(const Vector3d& tip, double jaw) {
    in.tools[1] = specimen::grasper(tip, jaw);
    in.tools[1].pivot = pivot;
    in.step = world.steps() + 1;
    ASSERT_NE(world.step(in, report), scene::Status::Fault);
    fastest = std::max(fastest, specimen::fastestKnot(world));
  }
  double fastest = 0;  // m/s, of any knot in any step
  scene::LooseShare share() {
    scene::LooseScratch scratch(world);
    return scene::looseShare(world, 0, scratch);
  }
  double height = 0.046;  // m, of the jaws' point

  void grasp() {
    for (int i = 0; i < 200; ++i) move({0.008, 0, height}, 1.0 - 0.9 * std::min(1.0, i / 150.0));
    ASSERT_TRUE(report.contacts[1].grasping);
  }
  void draw(double to) {
    for (; height < to; height += 1e-4) move({0.008, 0, height}, 0.1);
    for (int i = 0; i < 200; ++i) move({0.008, 0, height}, 0.1);
  }
};

TEST(Removal, WhatJawsDrawThroughTheirTrocarIsOut) {
  Removal r(false);
  r.grasp();
  r.draw(0.06);
  EXPECT_EQ(r.share().all, 1);
  EXPECT_EQ(r.share().removed, 0) << "in the jaws, but within";
  r.draw(r.pivot.z() - 0.003);
  EXPECT_TRUE(r.report.contacts[1].grasping);
  EXPECT_GT(r.share().removed, 0.95);
}

TEST(Removal, WhatHangsOnSomethingIsNotOut) {
  Removal r(true);
  r.grasp();
  r.draw(0.06);
  EXPECT_EQ(r.share().all, 0);
  EXPECT_EQ(r.share().removed, 0);
}

// Near the pivot the tip's mass was all that an instrument had to turn, and 4 N of tissue threw it about.
TEST(Removal, AnInstrumentThatIsDrawnToItsPivotTurnsNoLighter) {
  Removal r(true);
  r.grasp();
  r.draw(r.pivot.z() - 0.0005);
  EXPECT_TRUE(r.report.contacts[1].grasping);
  EXPECT_LT(r.fastest, 1.0) << "m/s: 12 before";
}

/// The bar, free, about 1 cm below the roof, and a wall that sinks by 4 cm within 0.2 s.
struct UnderTheWall {
  scene::World world{below()};
  scene::StepInput in;
  scene::StepReport report;
  static scene::Description below() {
    scene::Description d = inABox(false);
    for (auto* places : {&d.objects[0].position, &d.objects[0].rest_position})
      for (auto& p : *places) p.z() += 0.04;
    return d;
  }
  void run(double seconds, double sunk, double ramp = 0.2) {
    for (int i = 1; i <= static_cast<int>(seconds * 1000 + 0.5); ++i) {
      in.step = world.steps() + 1;
      in.sunk = ramp > 0 ? std::min(1.0, 1e-3 * i / ramp) * sunk : sunk;
      ASSERT_EQ(world.step(in, report), scene::Status::Ok);
      fastest = std::max(fastest, specimen::fastestKnot(world));
    }
  }
  double highest() const {
    double z = -1;
    for (std::uint32_t k = 0; k < world.knotCount(0); ++k) z = std::max(z, world.knotAt(0, k).z());
    return z;
  }
  double fastest = 0;
};

TEST(SunkenWall, PressesTissueDownByItsWeightAlone) {
  UnderTheWall free;
  free.run(1.0, 0.04);
  EXPECT_LT(free.highest(), kRoof - 0.04 + 0.004) << "the wall lies on it";
  EXPECT_GT(free.highest(), kRoof - 0.04) << "what carries the bar bears the wall's weight";
  EXPECT_LT(free.fastest, 1.0) << "m/s: nothing is thrown";
}

TEST(SunkenWall, ItsLowerHalfStays) {
  scene::Description d = inABox(false);
  for (auto* places : {&d.objects[0].position, &d.objects[0].rest_position})
    for (auto& p : *places) p.z() -= 0.02;
  UnderTheWall t;
  t.world = scene::World(d);
  const double before = t.highest();
  t.run(0.5, 0.04);
  EXPECT_EQ(t.highest(), before);
}

TEST(SunkenWall, TheEndoscopePropsItUp) {
  UnderTheWall t;
  t.in.tools[3].present = true;
  t.in.tools[3].tool = tools::ToolKind::Endoscope;
  t.in.tools[3].pivot = {0.01, 0, kRoof + 0.05};
  t.in.tools[3].position = {0.01, 0, kRoof + 0.02};
  t.in.tools[3].orientation =
      Eigen::Quaterniond::FromTwoVectors(Vector3d::UnitZ(), Vector3d(-Vector3d::UnitZ()));
  t.run(1.0, 0.04);
  EXPECT_GT(t.highest(), kRoof - 0.02) << "beside its lens";
}

/// A thread that floats 2 cm below the roof.
scene::Description threadBelow() {
  scene::Description d = inABox(false);
  scene::Suture s;
  s.material = "polyglactin_910", s.size = "2-0", s.kind = 2;
  s.strength = 43.8, s.knot_strength = 26.3;
  s.rod.name = "thread";
  for (int i = 0; i <= 20; ++i) s.rod.nodes.emplace_back(0.001 * i - 0.01, 0.03, kRoof - 0.02);
  s.rod.section = suture::solidSection(0.00016, 1125.0, 6e9, 0.4);
  s.rod.section.strain_damping = 1e-4, s.rod.section.drag = 1e-6;
  d.sutures.push_back(s);
  return d;
}

TEST(SunkenWall, PressesAThreadDownByItsWeightAlone) {
  UnderTheWall t;
  t.world = scene::World(threadBelow());
  const auto& nodes = t.world.state().threads.rod.position;
  const auto& velocity = t.world.state().threads.rod.velocity;
  double fastest = 0;
  for (int part = 0; part < 10; ++part) {
    t.run(0.1, 0.005 * (part + 1), 0);
    for (const Vector3d& v : velocity) fastest = std::max(fastest, v.norm());
  }
  double highest = 0;
  for (const Vector3d& x : nodes) highest = std::max(highest, x.z());
  EXPECT_LT(highest, kRoof - 0.05 + 0.002) << "the wall lies on it";
  EXPECT_LT(fastest, 2.0) << "m/s: nothing is thrown";
}

TEST(SunkenWall, LiesOnAShaftByItsWeight) {
  const auto lifted = [](double sunk) {
    UnderTheWall t;
    t.in.tools[1] = specimen::grasper({0, 0.05, 0.06}, 0.2);
    t.in.tools[1].pivot = {0.09, 0.05, kRoof + 0.04};
    t.in.tools[1].orientation = Eigen::Quaterniond::FromTwoVectors(
        Vector3d::UnitZ(), (t.in.tools[1].position - t.in.tools[1].pivot).normalized());
    t.run(0.5, sunk);
    EXPECT_EQ(t.report.contacts[1].in_contact, sunk > 0);
    return Vector3d(t.report.contacts[1].wrench.head<3>());
  };
  EXPECT_EQ(lifted(0).norm(), 0.0);
  // 300 Pa on some 6 cm of a shaft of 5 mm, less beside the trocar: 0.06 N at a right angle to it.
  const Vector3d felt = lifted(0.04);
  EXPECT_LT(felt.z(), -0.02);
  EXPECT_LT(felt.norm(), 0.10) << "N";
}

TEST(SunkenWall, ForHowLongAKnotIsNotLookedAtChangesNothing) {
  // What is restored remembers nothing of it: all is looked at in each step.
  UnderTheWall t, anew;
  const double before = t.highest();
  std::vector<std::uint8_t> bytes;
  for (int i = 0; i < 300; ++i) {
    const double sunk = i < 200 ? 2e-4 * i : 0.04 - 3e-4 * (i - 200);
    t.run(0.001, sunk, 0);
    anew.world.save(bytes);
    anew.world.restore(bytes);
    anew.run(0.001, sunk, 0);
    ASSERT_EQ(t.world.stateHash(), anew.world.stateHash()) << "step " << i;
  }
  EXPECT_LT(t.highest(), before - 0.003) << "the wall came down on it";
}

TEST(SunkenWall, WhereNothingIsMissingAllIsAsBefore) {
  UnderTheWall none, hardly;
  none.run(0.3, 0);
  hardly.run(0.3, contact::kLeastSunk, 0);
  EXPECT_EQ(none.world.stateHash(), hardly.world.stateHash());
  none.in.sunk = 2;
  EXPECT_EQ(none.world.step(none.in, none.report), scene::Status::Fault) << "m: no wall is so far down";
}

}  // namespace
