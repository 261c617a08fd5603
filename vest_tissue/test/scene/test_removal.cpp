#include <gtest/gtest.h>

#include "blades.h"
#include "vest_tissue/scene/loose.h"

// Protects that tissue leaves the cavity by a trocar alone: jaws draw a loose part out through the wall that
// their shaft enters by, and the World tells how much is out. What still hangs on something never counts.

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

}  // namespace
