// Suspension: what jaws hold is hung from the wall above, on nets and finite elements alike.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "blades.h"
#include "slab.h"
#include "theatre.h"
#include "vest_tissue/interaction/suspension.h"
#include "vest_tissue/scene/topology.h"
#include "vest_tissue/scene/world_model.h"

namespace {

using namespace vest;
using Eigen::Vector3d;
using fem::Motion;
using fem::Strain;
using scene::EventKind;

constexpr double kTop = 0.053;     // m: upper edge of every fold
constexpr double kTip = 0.0495;    // m: where the jaws' ends take it
constexpr double kLift = 0.006;    // m
constexpr double kCutAt = 0.0031;  // m along x: beside the stitch, through knots that hang

/// A fold along x whose ends are held, and one that nothing holds.
scene::Description net(bool held = true) {
  specimen::BarOptions o;
  o.columns = 17, o.rows = 2, o.spacing = 0.003, o.thickness = 0.006, o.mass = 0.004;
  o.bulk_modulus = 0.0, o.youngs_modulus = 10e3;
  o.fix_left = o.fix_right = held;
  return specimen::barScene(o);
}
scene::Description elements(Motion motion, Strain strain, bool held = true) {
  fem::Description d = fem::specimen::makeBox({16, 2, 3, 0.048, 0.003, 0.006}, false);
  d.name = "fold";
  d.motion = motion, d.strain = strain;
  d.material = {20e3, 0.4, 1050.0, 2.0, 0.004};
  for (fem::Index n = 0; n < d.nodes.size(); ++n) {
    const double x = d.nodes[n].x();
    if (held && (x == 0.0 || x > 0.0479)) d.fixed.push_back(n);
    d.nodes[n] += Vector3d(-0.024, -0.0015, 0.047);
  }
  return fem::specimen::sceneOf({fem::specimen::object(d)});
}
struct Kind {
  const char* name;
  scene::Description scene;
};
std::vector<Kind> folds() {
  std::vector<Kind> all;
  all.push_back({"net", net()});
  all.push_back({"small strain", elements(Motion::BackwardEuler, Strain::Small)});
  all.push_back({"corotational", elements(Motion::BackwardEuler, Strain::Corotational)});
  all.push_back({"elastostatic", elements(Motion::Elastostatic, Strain::Small)});
  return all;
}

struct Theatre : test::Theatre {
  using test::Theatre::Theatre;
  double height = 0.0;  // m: of the jaws over where they took hold
  double x = 0.0;       // m: where along the fold

  void jaws(double from, double to, int steps, std::uint32_t functions = 0) {
    use(tools::ToolKind::Grasper, Vector3d(x, 0, kTip + height), from, to, steps, functions);
  }
  void grasp() {
    jaws(0.8, 0.8, 20);
    jaws(0.8, 0.0, 100);
  }
  void lift(double to, int steps) {
    const double from = height;
    for (int i = 1; i <= steps && !testing::Test::HasFatalFailure(); ++i)
      height = from + (to - from) * i / steps, jaws(0.0, 0.0, 1);
  }
  void press(int steps = 30) {
    jaws(0.0, 0.0, steps, tools::kFunctionSuspend);
    jaws(0.0, 0.0, 5);
  }
  void open() {
    jaws(0.0, 0.8, 100);
    leave();
    run(5);
  }
  void hang() { grasp(), lift(kLift, 300), press(), open(); }
  const interaction::Suspension& first() const { return world.state().suspensions.all[0]; }
  /// m: of what hung first, or was nearest to the jaws.
  double heightOf(std::uint32_t knot) const { return world.knotAt(0, knot).z(); }
  std::uint32_t topKnot() const {
    std::uint32_t best = 0;
    double least = 1e30;
    for (std::uint32_t k = 0; k < world.knotCount(0); ++k) {
      const double distance = (world.description().objects[0].position[k] - Vector3d(x, 0, kTop)).norm();
      if (distance < least) least = distance, best = k;
    }
    return best;
  }
  double load() const {  // N: that the suspensions bear
    std::vector<scene::SuspensionView> views;
    world.suspensions(views);
    double sum = 0.0;
    for (const auto& v : views) sum += v.force.norm();
    return sum;
  }
};

TEST(Suspension, HoldsWhatTheJawsHeldUntilItIsTakenOff) {
  for (const Kind& kind : folds()) {
    SCOPED_TRACE(kind.name);
    Theatre t(kind.scene), control(kind.scene);
    const std::uint32_t top = t.topKnot();
    const double start = t.heightOf(top);
    control.grasp(), control.lift(kLift, 300), control.open(), control.run(1500);
    t.grasp(), t.lift(kLift, 300);
    const double lifted = t.heightOf(top);
    ASSERT_GT(lifted, start + 0.4 * kLift);
    t.press();
    ASSERT_EQ(t.count(EventKind::Suspended), 1u) << "one press, however long";
    t.open(), t.run(1500);
    ASSERT_FALSE(HasFatalFailure());
    EXPECT_EQ(t.count(EventKind::Released), 1u) << "the jaws are free";
    EXPECT_LT(control.heightOf(top), start + 0.2 * kLift) << "what nothing holds sinks back";
    EXPECT_NEAR(t.heightOf(top), lifted, 0.1 * kLift);
    EXPECT_GT(t.load(), 1e-3) << "N";
    std::printf("%s: lifted to %.2f mm, hangs at %.2f mm by %.3f N; let go: %.2f mm\n", kind.name,
                1e3 * (lifted - start), 1e3 * (t.heightOf(top) - start), t.load(),
                1e3 * (control.heightOf(top) - start));
    std::vector<scene::Attachment> told;
    t.world.attachments(told);
    ASSERT_EQ(told.size(), 1u);
    EXPECT_EQ(told[0].kind, 3) << "vest_msgs/TissueAttachment STITCH";

    t.grasp(), t.press();
    EXPECT_EQ(t.count(EventKind::Unsuspended), 1u);
    EXPECT_EQ(t.count(EventKind::Suspended), 1u);
    t.open(), t.run(1500);
    ASSERT_FALSE(HasFatalFailure());
    EXPECT_NEAR(t.heightOf(top), control.heightOf(top), 0.1 * kLift);
    EXPECT_EQ(t.load(), 0.0);
    t.world.attachments(told);
    EXPECT_TRUE(told.empty());
  }
}

// A foot that is down while the jaws close, or with nothing in them, asks for nothing.
TEST(Suspension, BeginsWithAPressAndTissueInTheJaws) {
  scene::Description d = net();
  d.gravity.setZero();
  Theatre t(d);
  t.height = 0.04;
  t.press(), t.open();
  EXPECT_EQ(t.count(EventKind::Suspended), 0u) << "nothing in the jaws";
  t.height = 0.0;
  t.jaws(0.8, 0.8, 20, tools::kFunctionSuspend);
  t.jaws(0.8, 0.0, 100, tools::kFunctionSuspend);
  ASSERT_EQ(t.count(EventKind::Grasped), 1u);
  EXPECT_EQ(t.count(EventKind::Suspended), 0u) << "pressed before there was anything in them";
  t.jaws(0.0, 0.0, 5);
  t.press();
  EXPECT_EQ(t.count(EventKind::Suspended), 1u);
}

TEST(Suspension, TearsOutAboveItsStrengthAndHoldsNothingThen) {
  for (const Kind& kind : folds()) {
    SCOPED_TRACE(kind.name);
    Theatre t(kind.scene);
    t.grasp(), t.press();
    ASSERT_EQ(t.count(EventKind::Suspended), 1u);
    for (int i = 0; i < 8000 && t.count(EventKind::TornOut) == 0 && !HasFatalFailure(); ++i) {
      t.lift(t.height + 1e-5, 1);
      // Jaws and thread hold the same knots: what the jaws pull with more is what the tissue takes.
      const double felt = t.report.contacts[1].wrench.head<3>().norm();
      if (i == 1000) {
        EXPECT_NEAR(t.load(), felt, 0.1 * felt);
      }
    }
    ASSERT_FALSE(HasFatalFailure());
    ASSERT_EQ(t.count(EventKind::TornOut), 1u);
    const scene::Event& e = *t.event(EventKind::TornOut);
    EXPECT_EQ(e.instrument, -1);
    EXPECT_GT(e.force, interaction::kSuspensionStrength);
    EXPECT_LT(e.force, 1.1 * interaction::kSuspensionStrength) << "a slow pull goes no further";
    EXPECT_EQ(t.load(), 0.0);
    EXPECT_TRUE(t.world.state().grasps[1].active) << "the jaws hold on";
    std::printf("%s: torn out at %.2f N\n", kind.name, e.force);
  }
}

// The instrument that hung it goes away, and is not what bears it: the wall is.
TEST(Suspension, BearsTheWeightAndNoInstrumentFeelsIt) {
  for (const Kind& kind : {Kind{"net", net(false)},
                           Kind{"elements", elements(Motion::BackwardEuler, Strain::Corotational, false)}}) {
    SCOPED_TRACE(kind.name);
    scene::Description d = kind.scene;
    const Vector3d gravity = d.gravity;
    ASSERT_GT(gravity.norm(), 9.0);
    d.gravity.setZero();  // until it is held
    Theatre t(d);
    t.grasp(), t.press();
    for (int axis = 0; axis < 3; ++axis) {
      const char* const name[] = {"gravity_x", "gravity_y", "gravity_z"};
      t.input.edits.push_back({"", name[axis], gravity[axis]});
    }
    t.step();
    t.input.edits.clear();
    t.jaws(0.0, 0.8, 100);
    t.height = 0.03;
    t.jaws(0.8, 0.8, 3000);
    ASSERT_FALSE(HasFatalFailure());
    double mass = 0.0;
    for (const double m : d.objects[0].mass) mass += m;
    const Vector3d reaction = t.world.reaction(0);
    std::printf("%s: bears %.5f N of %.5f N\n", kind.name, reaction.z(), mass * gravity.norm());
    EXPECT_NEAR(reaction.z(), mass * gravity.norm(), 0.01 * mass * gravity.norm());
    EXPECT_NEAR(t.load(), mass * gravity.norm(), 0.01 * mass * gravity.norm());
    EXPECT_EQ(t.report.contacts[1].wrench.norm(), 0.0) << "it is 30 mm away";
    EXPECT_FALSE(t.report.contacts[1].in_contact);
  }
}

// Jaws draw at what hangs until its springs hold more than all the tissue, and then take it off.
TEST(Suspension, KeepsTheEnergysAccount) {
  scene::Description d = net();
  d.gravity.setZero();
  Theatre t(d);
  t.world.accountEnergy(true);
  const auto sum = [&] {
    const scene::Energy e = t.world.energy();
    return e.kinetic + e.elastic + e.potential + e.dissipated - e.work;
  };
  t.grasp(), t.press();
  const double start = sum(), before = t.world.energy().work;
  for (int i = 0; i < 5000 && t.load() < 3.0 && !HasFatalFailure(); ++i) t.lift(t.height + 1e-5, 1);
  ASSERT_GT(t.load(), 2.9) << "N";
  const double drawn = sum(), work = t.world.energy().work - before;
  EXPECT_NEAR(drawn, start, 0.02 * work);
  t.press();
  ASSERT_EQ(t.count(EventKind::Unsuspended), 1u);
  ASSERT_FALSE(HasFatalFailure());
  std::printf("energy: %.4g J of work; %.3g J too much as it is drawn, %.3g J as it is taken off\n", work,
              drawn - start, sum() - start);
  EXPECT_NEAR(sum(), start, 0.05 * work) << "of a jerk, as other tests ask";
}

/// Scissors from above, jaws open along y, that divide the fold at x.
void divide(Theatre& t, double x) {
  for (int i = 0; i < 250 && !testing::Test::HasFatalFailure(); ++i) {
    const double come = std::min(1.0, i / 80.0), close = std::clamp((i - 80.0) / 150.0, 0.0, 1.0);
    t.input.tools[1] = specimen::toolAt(tools::ToolKind::Scissors, Vector3d(x, 0, 0.070 - 0.027 * come),
                                        -Vector3d::UnitZ(), Vector3d::UnitY(), 0.9 * (1.0 - close));
    t.step();
  }
  t.leave();
  t.run(300);
}

// Cut beside the stitch, through knots that hang: these stay with the stitch's side, not with the other.
TEST(Suspension, StaysOnItsSideOfACutAndTheStateGoesOnAlike) {
  for (const Kind& kind : folds())
    for (const double cut_at : {kCutAt, -kCutAt}) {
      SCOPED_TRACE(std::string(kind.name) + ", cut at " + std::to_string(cut_at));
      Theatre one(kind.scene), threads(kind.scene, 3), restored(kind.scene);
      std::vector<std::uint8_t> hung, cut;
      for (Theatre* each : {&one, &threads}) {
        each->grasp(), each->press(), each->open();
        if (each == &one) one.world.save(hung);
        divide(*each, cut_at);
        if (each == &one) one.world.save(cut);
      }
      ASSERT_FALSE(HasFatalFailure());
      ASSERT_GE(one.count(EventKind::Cut), 1u);
      EXPECT_EQ(one.world.stateHash(), threads.world.stateHash()) << "three threads";
      restored.world.restore(hung);
      divide(restored, cut_at);
      EXPECT_EQ(one.world.stateHash(), restored.world.stateHash()) << "from a snapshot";
      std::vector<std::uint8_t> again;
      restored.world.save(again);
      EXPECT_TRUE(again == cut);
      const scene::ObjectState& s = one.world.state().objects[0];
      const auto& start = one.world.description().objects[0].position;
      const auto origin = [&](std::uint32_t k) { return scene::originalKnot(s.topology, start.size(), k); };
      const interaction::Suspension& h = one.first();
      ASSERT_TRUE(h.alive);
      int divided = 0;
      for (std::int32_t i = 0; i < h.count; ++i) {
        const std::uint32_t knot = h.knots[static_cast<std::size_t>(i)].knot;
        ASSERT_LT(knot, s.block.knots());
        const auto& doubled = s.topology.doubled_knots;
        divided += std::find(doubled.begin(), doubled.end(), origin(knot)) != doubled.end();
        // Corners of the triangles around it, in the shape at the start: all on the stitch's side.
        double sum = 0.0;
        int corners = 0;
        for (std::size_t n = 0; n < s.triangles.size(); ++n) {
          const auto& k = s.triangles[n];
          if (!s.triangle_alive[n] || std::find(k.begin(), k.end(), knot) == k.end()) continue;
          for (const std::uint32_t corner : k) sum += start[origin(corner)].x(), ++corners;
        }
        ASSERT_GT(corners, 0);
        EXPECT_LT(sum / corners * (cut_at > 0.0 ? 1.0 : -1.0), kCutAt) << "knot " << knot;
      }
      EXPECT_GE(divided, 1) << "the cut went through knots that hang";
      std::printf("%s: %d of %d knots that hang were divided\n", kind.name, divided, h.count);
    }
}

// A step that fails takes back what it hung.
TEST(Suspension, IsGivenBackByAFault) {
  Theatre t(net());
  t.worst = scene::Status::Fault;
  t.grasp();
  ASSERT_TRUE(t.world.state().grasps[1].active);
  for (int i = 0; i < 1000; ++i) t.input.impacts.push_back({0, 5, {0.3, 0.3, 0.4}, Vector3d(1e3, 0, 0)});
  t.jaws(0.0, 0.0, 1, tools::kFunctionSuspend);
  ASSERT_EQ(t.report.status, scene::Status::Fault);
  EXPECT_FALSE(t.first().alive);
  EXPECT_FALSE(t.world.state().suspensions.pressed[1]);
  EXPECT_EQ(t.count(EventKind::Suspended), 0u);
}

TEST(Suspension, BeyondTheLastOneNothingIsHungAndTheStepSaysSo) {
  scene::Description d = net();
  d.gravity.setZero();
  Theatre t(d);
  const double places[] = {-0.018, -0.009, 0.0, 0.009, 0.018};
  for (int i = 0; i < 5; ++i) {
    t.x = places[i];
    t.grasp();
    ASSERT_TRUE(t.world.state().grasps[1].active) << i;
    const std::size_t before = t.count(EventKind::Suspended);
    t.jaws(0.0, 0.0, 1, tools::kFunctionSuspend);
    const bool room = i < static_cast<int>(interaction::kMaxSuspensions);
    EXPECT_EQ(t.count(EventKind::Suspended), before + (room ? 1u : 0u)) << i;
    EXPECT_EQ(t.report.status, room ? scene::Status::Ok : scene::Status::Degraded) << i;
    t.jaws(0.0, 0.0, 3), t.open();
  }
  ASSERT_FALSE(HasFatalFailure());
}

}  // namespace
