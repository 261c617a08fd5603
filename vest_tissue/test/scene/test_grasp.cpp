#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "theatre.h"
#include "vest_tissue/scene/world.h"

namespace {

using namespace vest;
using Eigen::Vector3d;

/// A tube at rest under gravity, a grasper from above.
struct Theatre : test::Theatre {
  std::vector<float> start;

  Theatre() : test::Theatre(specimen::tubeScene()) {
    world.accountEnergy(true);
    for (int i = 0; i < 3000; ++i) step();
    start.resize(3 * world.knotCount(0));
    world.positions(0, start.data());
  }
  void tool(double z, double jaw) {
    input.tools[1] = specimen::grasper(Vector3d(0, 0, z), jaw);
    input.tools[1].pivot = Vector3d(0, 0, 0.17);
  }
  /// Moves tip and jaw linearly over a time.
  void move(double z0, double z1, double jaw0, double jaw1, double seconds) {
    const int n = static_cast<int>(seconds * 1000);
    for (int i = 1; i <= n; ++i) {
      const double s = static_cast<double>(i) / n;
      tool(z0 + s * (z1 - z0), jaw0 + s * (jaw1 - jaw0));
      step();
    }
  }
  void grasp() {
    move(0.075, 0.040, 1.0, 1.0, 0.4);
    move(0.040, 0.040, 1.0, 0.05, 0.4);
  }
  const scene::ContactModel& contact() const { return report.contacts[1]; }
  double away() {
    std::vector<float> p(start.size());
    world.positions(0, p.data());
    double most = 0;
    for (std::size_t i = 0; i < p.size(); ++i) most = std::max(most, std::fabs(double(p[i]) - start[i]));
    return most;
  }
};

TEST(Grasp, ClosingJawsHoldTheTubeWithoutAForceThatJumps) {
  Theatre t;
  t.move(0.075, 0.040, 1.0, 1.0, 0.4);
  double last = t.contact().wrench.head<3>().norm();
  for (int i = 1; i <= 400; ++i) {
    t.tool(0.040, 1.0 - 0.95 * i / 400);
    t.step();
    const double force = t.contact().wrench.head<3>().norm();
    EXPECT_LT(std::fabs(force - last), 0.05) << "step " << i;
    last = force;
  }
  ASSERT_TRUE(t.saw(scene::EventKind::Grasped));
  EXPECT_TRUE(t.contact().grasping);
  EXPECT_GT(t.contact().pinch_force, 3.0);
  std::vector<scene::Attachment> held;
  t.world.attachments(held);
  ASSERT_EQ(held.size(), 1u);
  EXPECT_GT(held[0].station, 0.02);
  EXPECT_LT(held[0].station, 0.08);
}

TEST(Grasp, TheForceModelHoldsAsFarAsTheToolIsThick) {
  Theatre t;
  t.move(0.075, 0.040, 1.0, 1.0, 0.1);
  EXPECT_EQ(t.contact().radius, 0.0012) << "jaws of a grasper";
  t.input.tools[1].tool = tools::ToolKind::CoagulationHook;
  t.step();
  EXPECT_EQ(t.contact().radius, 0.0015) << "its ceramic neck";
  t.input.tools[1].tool = tools::ToolKind::SuctionIrrigator;
  t.step();
  EXPECT_EQ(t.contact().radius, 0.0025) << "nothing beyond its shaft";
}

TEST(Grasp, PullHoldAndReleaseBalanceForceEnergyAndShape) {
  Theatre t;
  t.grasp();
  ASSERT_TRUE(t.contact().grasping);
  const auto before = t.world.energy();
  const Vector3d reaction_before = t.world.reaction(0), force_before = t.contact().wrench.head<3>();
  // Work as an outside observer sums it: force of the tool on the tissue times the proxy's way.
  double observed = 0, last_force = 0;
  for (int i = 1; i <= 1000; ++i) {
    t.tool(0.040 + 0.03 * i / 1000, 0.05);
    t.step();
    observed += -t.contact().wrench.head<3>().dot(t.contact().velocity.head<3>()) * 1e-3;
    const double force = t.contact().wrench.head<3>().norm();
    EXPECT_LT(std::fabs(force - last_force), 0.05);
    last_force = force;
  }
  for (int i = 0; i < 2000; ++i) t.step();  // hold: everything comes to rest
  const auto held = t.world.energy();
  const double stored =
      held.elastic + held.potential + held.kinetic - before.elastic - before.potential - before.kinetic;
  const double lost = held.dissipated - before.dissipated;
  ASSERT_GT(observed, 1e-4);
  EXPECT_NEAR(observed, stored + lost, 0.05 * observed);
  EXPECT_NEAR(held.work - before.work, observed, 0.05 * observed);
  // At rest the tool's force is what the attachments take up more than before.
  const Vector3d change =
      t.world.reaction(0) - reaction_before + (-t.contact().wrench.head<3>() + force_before);
  EXPECT_LT(change.norm(), 0.02 * t.contact().wrench.head<3>().norm());
  EXPECT_GT(-t.contact().wrench[2], 0.05) << "the tissue pulls the raised tool down";
  // Let go.
  t.move(0.070, 0.070, 0.05, 1.0, 0.2);
  t.move(0.070, 0.090, 1.0, 1.0, 0.3);
  ASSERT_TRUE(t.saw(scene::EventKind::Released));
  EXPECT_FALSE(t.contact().grasping);
  for (int i = 0; i < 6000; ++i) t.step();
  EXPECT_EQ(t.contact().wrench.norm(), 0.0);
  EXPECT_LT(t.away(), 0.0005) << "the organ returns";
}

TEST(Grasp, AWeakPinchSlipsWhereAStrongOneHolds) {
  Theatre weak;
  weak.move(0.075, 0.040, 1.0, 1.0, 0.4);
  // Closes until it just holds.
  double jaw = 1.0;
  for (int i = 0; i < 2000 && !weak.contact().grasping; ++i) {
    jaw -= 0.0005;
    weak.tool(0.040, jaw);
    weak.step();
  }
  ASSERT_TRUE(weak.contact().grasping);
  const double pinch = weak.contact().pinch_force;
  for (int i = 1; i <= 1500 && !weak.saw(scene::EventKind::Slipped); ++i) {
    weak.tool(0.040 + 0.06 * i / 1500, jaw);
    weak.step();
    EXPECT_LT(weak.contact().wrench.head<3>().norm(), 1.5 * (5.0 / 3.0) * pinch + 0.05);
  }
  EXPECT_TRUE(weak.saw(scene::EventKind::Slipped));
  Theatre strong;
  strong.grasp();
  strong.move(0.040, 0.085, 0.05, 0.05, 1.0);
  EXPECT_FALSE(strong.saw(scene::EventKind::Slipped));
  EXPECT_TRUE(strong.contact().grasping);
}

TEST(Contact, AFastThinShaftDoesNotTunnelThroughTheTube) {
  Theatre t;
  // A shaft along y beside the tube, swept through it along z at 1 m/s.
  const auto place = [&](double z) {
    auto& tool = t.input.tools[0];
    tool.present = true;
    tool.tool = tools::ToolKind::SuctionIrrigator;
    tool.pivot = Vector3d(0.01, -0.10, z);
    tool.position = Vector3d(0.01, 0.05, z);
    Eigen::Matrix3d r;
    r.col(2) = Vector3d::UnitY(), r.col(0) = Vector3d::UnitX(), r.col(1) = r.col(2).cross(r.col(0));
    tool.orientation = Eigen::Quaterniond(r);
  };
  place(0.060);
  for (int i = 0; i < 50; ++i) t.step();
  for (double z = 0.060; z > 0.030; z -= 0.001) {
    place(z);
    t.step();
  }
  std::vector<float> p(3 * t.world.knotCount(0));
  t.world.positions(0, p.data());
  double highest = 0;  // of the knots under the shaft
  for (std::size_t i = 0; i < t.world.knotCount(0); ++i) {
    if (std::fabs(p[3 * i] - 0.01) < 0.004) highest = std::max(highest, double(p[3 * i + 2]));
  }
  EXPECT_LT(highest, 0.034) << "the tube was pushed in front of the shaft";
  EXPECT_GT(t.report.contacts[0].wrench[2], 0.0) << "and pushes back";
}

/// Its first anchor stands for a grasp: where that of the first organ slips out, another organ has fewer
/// triangles.
TEST(Grasp, OfTwoOrgansKeepsATriangleOfWhatItStillHolds) {
  scene::Description d = specimen::tubeScene();
  specimen::TubeOptions small;
  small.name = "small", small.rings = 3, small.around = 3, small.length = 0.01, small.centre.y() += 0.1;
  d.objects.push_back(specimen::tube(small));
  scene::World world(d);
  const auto last = static_cast<std::uint32_t>(world.contactTriangles(0).size()) - 1;
  ASSERT_GT(last, world.contactTriangles(1).size());
  auto& state = const_cast<scene::WorldState&>(world.state());
  scene::StepInput input;
  scene::StepReport report;
  input.tools[1] = specimen::grasper(Vector3d(0, 0.1, 0.06), 0.05);
  world.step(input, report);
  interaction::Grasp& grasp = state.grasps[1];
  grasp.active = true, grasp.jaw_at_touch = 0.5, grasp.count = 2, grasp.element = last;
  grasp.anchors[0].object = 0, grasp.anchors[0].local = Vector3d(0, 0, 1.0);
  grasp.anchors[1].object = 1, grasp.anchors[1].knot = 4, grasp.anchors[1].local = Vector3d(0, 0, -0.005);
  world.step(input, report);
  ASSERT_EQ(grasp.count, 1);
  ASSERT_EQ(grasp.anchors[0].object, 1);
  ASSERT_LT(grasp.element, world.contactTriangles(1).size());
  const auto& triangle = world.contactTriangles(1)[grasp.element];
  EXPECT_TRUE(std::find(triangle.begin(), triangle.end(), 4u) != triangle.end());
}

}  // namespace
