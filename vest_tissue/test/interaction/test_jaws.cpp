#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "blades.h"
#include "vest_tissue/interaction/suction.h"
#include "vest_tissue/scene/world_model.h"

namespace {

using namespace vest;
using Eigen::Vector3d;

/// A tool on one object, step by step.
struct Bench {
  scene::World world;
  scene::StepInput input;
  scene::StepReport report;
  double force = 0.0, torque = 0.0, speed = 0.0;  // greatest so far: N, N·m, m/s

  explicit Bench(const scene::Description& d) : world(d) {}
  void step() {
    input.step = world.steps();
    ASSERT_NE(world.step(input, report), scene::Status::Fault) << report.fault_object;
    force = std::max(force, report.contacts[1].wrench.head<3>().norm());
    torque = std::max(torque, std::fabs(world.state().proxies[1].jaw_torque));
    std::vector<float> v(3 * world.knotCount(0));
    world.velocities(0, v.data());
    for (const float c : v) speed = std::max(speed, static_cast<double>(std::fabs(c)));
  }
  void run(int steps) {
    for (int i = 0; i < steps && !testing::Test::HasFatalFailure(); ++i) step();
  }
};

// A contact whose place was almost on a fixed knot took the vanishing weight of the free one for its own and
// answered with any force: 300 kN in the gynaecology scene.
TEST(Contact, BesideFixedKnotsPushesWithTheForceOfItsDepthAlone) {
  specimen::TubeOptions o;
  o.radius = 0.004, o.youngs_modulus = 1.5e5, o.a3 = 6.0;
  for (int place = 0; place < 40; ++place) {
    Bench b(specimen::tubeScene(o));
    const double x = -0.0515 + 0.0002 * place;  // across the fixed end of the tube, its ring at -0.05
    auto& t = b.input.tools[1];
    for (int i = 0; i <= 60; ++i) {
      t = specimen::grasper(Vector3d(x, 0.0003, 0.060 - 0.0001 * i), 0.0);
      b.step();
    }
    ASSERT_FALSE(HasFatalFailure()) << "x " << x;
    EXPECT_LT(b.force, 20.0) << "x " << x;
    EXPECT_LT(b.speed, 5.0) << "x " << x;
  }
}

TEST(Jaws, FollowTheHandleExactlyWhereNothingIsBetweenThem) {
  Bench b(specimen::tubeScene());
  for (int i = 0; i <= 100; ++i) {
    b.input.tools[1] = specimen::grasper(Vector3d(0, 0, 0.12), 1.0 - 0.01 * i);
    b.step();
    ASSERT_EQ(b.world.state().proxies[1].pose.jaw, b.input.tools[1].jaw) << i;
  }
}

// A sucker whose valve is down holds what its mouth touches, by the vacuum and no harder; it comes off with a
// pull, or when the valve is let up.
TEST(Sucker, HoldsTissueByItsVacuumUntilItIsPulledOff) {
  specimen::BarOptions o;
  o.columns = 25, o.youngs_modulus = 6e4, o.bulk_modulus = 0;
  scene::Description d = specimen::barScene(o);
  d.gravity.setZero();
  Bench b(d);
  const double mouth = tools::toolGeometry(tools::ToolKind::SuctionIrrigator).shaft_radius;
  int held = 0, released = 0;
  double lifted = 0.0;
  const auto go = [&](double height, std::uint32_t functions) {  // m: of the mouth over the bar's upper face
    b.input.tools[1] =
        specimen::toolAt(tools::ToolKind::SuctionIrrigator, Vector3d(0, 0, 0.052 + mouth + height),
                         -Vector3d::UnitZ(), Vector3d::UnitX());
    b.input.tools[1].functions = functions;
    b.step();
    for (const auto& e : b.report.events) {
      held += e.kind == scene::EventKind::Grasped;
      released += e.kind == scene::EventKind::Released;
    }
    for (std::uint32_t k = 0; k < b.world.knotCount(0); ++k)
      lifted = std::max(lifted, b.world.knotAt(0, k).z() - 0.052);
  };
  const auto lift = [&](std::uint32_t functions) {
    for (int i = 0; i <= 300; ++i) go(0.002 - 1e-5 * i, functions);  // 1 mm into it
    lifted = 0.0;
    for (int i = 0; i <= 3000; ++i) go(-0.001 + 1e-5 * i, functions);
  };
  lift(0);
  ASSERT_FALSE(HasFatalFailure());
  EXPECT_EQ(held, 0) << "the valve is up";
  EXPECT_LT(lifted, 0.0005);
  b.force = 0;
  lift(tools::kFunctionSuck);
  ASSERT_FALSE(HasFatalFailure());
  EXPECT_EQ(held, 1);
  EXPECT_EQ(released, 1) << "pulled off";
  EXPECT_GT(lifted, 0.003) << "it came along";
  EXPECT_GT(b.force, 0.5 * interaction::kSuctionForce);
  const Vector3d pull = b.report.contacts[1].wrench.head<3>();
  EXPECT_LT(pull.norm(), 1e-6) << "and is off";
  for (int i = 0; i <= 310; ++i) go(0.002 - 1e-5 * i, tools::kFunctionSuck);
  EXPECT_EQ(held, 2);
  go(-0.001, 0);
  EXPECT_EQ(released, 2) << "the valve is let up";
}

// They close by a hand: a clip forms on the soft strip, and beside it lies one as hard as bone. The jaws stop
// where the hand's grip ends.
TEST(Jaws, CloseNoHarderThanAHandOverWhatDoesNotGiveWay) {
  specimen::BarOptions soft, hard;
  soft.columns = 33, soft.rows = 2, soft.spacing = 0.0015, soft.centre.y() = -0.0012;
  hard.columns = 17, hard.rows = 2, hard.spacing = 0.0024, hard.centre.y() = 0.0013;
  hard.youngs_modulus = 3e7, hard.bulk_modulus = 0.0, hard.mass = 0.05;
  scene::Description d = specimen::barScene(soft);
  d.objects.push_back(specimen::bar(hard));
  d.objects[1].name = "bone";
  d.gravity.setZero();
  Bench b(d);
  const auto close = [&](double jaw) {
    b.input.tools[1] = specimen::toolAt(tools::ToolKind::ClipApplier, Vector3d(0, 0, 0.046),
                                        -Vector3d::UnitZ(), Vector3d::UnitY(), jaw);
    b.step();
  };
  const double limit =
      0.5 * tools::toolGeometry(tools::ToolKind::ClipApplier).jaw_length * interaction::kJawForceLimit;
  for (int i = 0; i < 30; ++i) close(0.6);
  for (int i = 1; i <= 200; ++i) close(0.6 - 0.003 * i);
  double least = limit, most = 0.0;
  for (int i = 0; i < 200; ++i) {
    close(0.0);
    const double torque = b.world.state().proxies[1].jaw_torque;
    if (i >= 20) least = std::min(least, torque), most = std::max(most, torque);
  }
  ASSERT_FALSE(HasFatalFailure());
  EXPECT_LT(most, 1.05 * limit) << "in each single step";
  EXPECT_GT(least, 0.95 * limit) << "what is as hard as bone does not chatter";
  EXPECT_LT(b.torque, 2.0 * limit) << "one step late, at the hand's speed";
  EXPECT_GT(b.world.state().proxies[1].pose.jaw, 0.1) << "it is in the way";
  EXPECT_LT(b.force, 40.0);
  EXPECT_LT(b.speed, 1.0);
}

}  // namespace
