// Loops that are tied beforehand in a World: a pusher takes one out of its packet, draws it, and lets it go.
#include <gtest/gtest.h>

#include <cstdlib>

#include "nets.h"
#include "roeder_knot.h"
#include "vest_tissue/scene/world.h"
#include "vest_tissue/scene/world_model.h"

namespace {

using namespace vest;
using Eigen::Vector3d;

constexpr double kPoint = 0.0112;  // m: from the tip frame to the pusher's end
constexpr int kHand = 1;

/// A tube far below, and one loop in a packet far away.
scene::Description packet() {
  scene::Description d;
  d.name = "air", d.hash = "0000000000000007";
  d.objects.push_back(specimen::tubeScene({}).objects[0]);
  for (Vector3d& x : d.objects[0].position) x.z() -= 1.0;
  d.objects[0].rest_position = d.objects[0].position;
  scene::Suture s;
  s.material = "polyglactin_910", s.size = "0", s.kind = 2;
  s.strength = 63.7, s.knot_strength = 38.2;
  s.loop = 0.12;
  s.loop_at = Vector3d(2, 0, 0), s.loop_ahead = Vector3d::UnitY(), s.loop_across = Vector3d::UnitZ();
  s.rod.name = "loop";
  s.rod.section = suture::specimen::polyglactin();
  s.rod.natural_shape = true;
  suture::RoederLoop loop;
  loop.diameter = 2.0 * s.rod.section.radius;
  const Eigen::Matrix3d axes = suture::loopAxes(s.loop_ahead, s.loop_across);
  for (const Vector3d& x : suture::roederLoop(loop)) s.rod.nodes.push_back(s.loop_at + axes * x);
  d.sutures.push_back(s);
  return d;
}

struct Room {
  scene::World world;
  scene::StepInput input;
  scene::StepReport report;
  explicit Room(const scene::Description& d) : world(d, 1) {}
  void step(int steps = 1) {
    for (int k = 0; k < steps; ++k) {
      input.step = world.steps() + 1;
      ASSERT_NE(world.step(input, report), scene::Status::Fault);
    }
  }
  void hold(const Vector3d& tip, bool draw) {
    input.tools[kHand] = specimen::grasper(tip, -Vector3d::UnitZ(), Vector3d::UnitX(), 0.0);
    input.tools[kHand].tool = tools::ToolKind::SlingApplicator;
    input.tools[kHand].functions = draw ? static_cast<std::uint32_t>(tools::kFunctionFire) : 0u;
  }
  const interaction::ThreadState& threads() const { return world.state().threads; }
  const std::vector<Vector3d>& nodes() const { return threads().rod.position; }
};

const Vector3d kTip(0.1, 0.2, 0.3);

TEST(Loops, LieInTheirPacketUntilAPusherTakesOne) {
  Room m(packet());
  const std::vector<Vector3d> laid = m.nodes();
  m.step(50);
  for (std::size_t i = 0; i < laid.size(); ++i)
    ASSERT_LT((m.nodes()[i] - laid[i]).norm(), 0.002) << "m: it does not fall, node " << i;
  m.hold(kTip, false);
  m.step();
  const auto& pusher = m.threads().pushers[kHand];
  ASSERT_TRUE(pusher.active);
  EXPECT_EQ(m.threads().packed[0], 0u);
  const Vector3d point = kTip - Vector3d(0, 0, kPoint);
  EXPECT_LT((m.nodes()[pusher.inside] - point).norm(), 0.001) << "m: the thread leaves the pusher's point";
  for (std::uint32_t i = 0; i < pusher.inside; ++i)
    EXPECT_LT((m.nodes()[i] - point).head<2>().norm(), 3e-4) << "m off the axis, node " << i;
  double ahead = 0.0, across = 0.0, beside = 0.0;
  for (const Vector3d& x : m.nodes()) {
    ahead = std::max(ahead, point.z() - x.z());
    across = std::max(across, std::abs(x.x() - point.x()));
    if (point.z() - x.z() > 0.005) beside = std::max(beside, std::abs(x.y() - point.y()));
  }
  EXPECT_NEAR(ahead, 0.12 / M_PI + 0.002, 0.002) << "m: the loop lies ahead,";
  EXPECT_NEAR(across, 0.06 / M_PI, 0.002) << "in the plane in which jaws open";
  EXPECT_LT(beside, 0.003);
}

TEST(Loops, ThePointDrawsInTheStandingPartAndStopsTheKnot) {
  Room m(packet());
  m.hold(kTip, false);
  m.step(200);
  const std::uint32_t inside = m.threads().pushers[kHand].inside;
  m.hold(kTip, true);
  m.step(1000);
  EXPECT_NEAR(m.threads().pushers[kHand].drawn, 0.04, 0.001) << "m: 40 mm/s";
  EXPECT_NEAR(m.threads().pushers[kHand].inside - inside, 0.04 / 0.00075, 4) << "nodes went in";
  double ahead = 0.0, behind = 1.0;
  for (std::size_t i = m.threads().pushers[kHand].inside + 1; i < m.nodes().size(); ++i) {
    const double z = kTip.z() - kPoint - m.nodes()[i].z();
    ahead = std::max(ahead, z), behind = std::min(behind, z);
  }
  EXPECT_LT(ahead, 0.034) << "m: the loop is smaller";
  std::printf("the knot begins %.2f mm before the point\n", 1e3 * behind);
  EXPECT_GT(behind, 0.0) << "m: nothing else has gone in";
  suture::KnotScratch w(m.nodes().size());
  EXPECT_EQ(suture::kindOf(m.nodes().data(), m.nodes().size(), w).determinant, 29);
}

TEST(Loops, GoOnFromASnapshotInTheSameBits) {
  Room m(packet());
  m.hold(kTip, true);
  m.step(150);
  std::vector<std::uint8_t> bytes;
  m.world.save(bytes);
  m.step(100);
  Room other(packet());
  other.world.restore(bytes);
  other.hold(kTip, true);
  other.step(100);
  EXPECT_EQ(other.world.stateHash(), m.world.stateHash());
  Room idle(packet());
  idle.hold(kTip, true);
  idle.step(150);
  idle.hold(kTip, false);
  idle.step(100);
  EXPECT_NE(idle.world.stateHash(), m.world.stateHash());
}

TEST(Loops, APusherThatGoesLetsTheThreadGoAndTheNextOneHasASling) {
  Room m(packet());
  m.hold(kTip, false);
  m.step(20);
  std::vector<scene::SlingView> slings;
  m.world.slings(slings);
  EXPECT_TRUE(slings.empty()) << "a thread is in the pusher";
  m.input.tools[kHand].present = false;
  m.step(20);
  EXPECT_FALSE(m.threads().pushers[kHand].active);
  EXPECT_LT(m.threads().rod.velocity[0].z(), -0.1) << "m/s: it falls";
  m.hold(kTip, false);
  m.step(2);
  EXPECT_FALSE(m.threads().pushers[kHand].active) << "no packet is left";
  m.world.slings(slings);
  EXPECT_EQ(slings.size(), 1u) << "the loop by its law";
}

}  // namespace
