#include <gtest/gtest.h>

#include <cmath>

#include "nets.h"
#include "vest_tissue/scene/world.h"
#include "vest_tissue/scene/world_model.h"

// Protects that a clip takes a pedicle: all objects between its jaws, which it holds to each other.

namespace {

using namespace vest;
using Eigen::Vector3d;

/// Two vessels one above the other, with a gap between them.
scene::Description vessels() {
  scene::Description d;
  d.name = "pedicle", d.gravity.setZero();
  for (int i = 0; i < 2; ++i) {
    specimen::TubeOptions o;
    o.name = i == 0 ? "artery" : "vein";
    o.radius = 0.0015, o.rings = 24, o.length = 0.07, o.mass = 0.001, o.fix_ends = i == 0;
    o.centre.z() += i == 0 ? 0.0021 : -0.0021;
    d.objects.push_back(specimen::tube(o));
  }
  return d;
}

TEST(Pedicle, AClipTakesAllThatIsBetweenItsJawsAndHoldsItTogether) {
  scene::World w(vessels());
  scene::StepInput in;
  scene::StepReport report;
  std::size_t clipped[2] = {}, unclipped[2] = {};
  const auto step = [&] {
    in.step = w.steps();
    ASSERT_NE(w.step(in, report), scene::Status::Fault);
    in.requests.clear(), in.loads.clear(), in.load_over = 0.0;
    for (const auto& e : report.events) {
      if (e.kind == scene::EventKind::Clipped) ++clipped[e.object];
      if (e.kind == scene::EventKind::Unclipped) ++unclipped[e.object];
    }
  };
  for (int i = 0; i < 360; ++i) {
    in.tools[1] = specimen::grasper(Vector3d(0, 0, 0.0425), 0.6 * std::min(1.0, (360 - i) / 300.0));
    in.tools[1].tool = tools::ToolKind::ClipApplier;
    step();
  }
  in.tools[1].present = false;
  for (int i = 0; i < 100; ++i) step();
  ASSERT_EQ(clipped[0], 1u);
  ASSERT_EQ(clipped[1], 1u);
  std::vector<scene::Attachment> held;
  w.attachments(held);
  ASSERT_EQ(held.size(), 2u);
  EXPECT_EQ(held[0].id, held[1].id) << "one clip";
  for (const auto& a : held) EXPECT_GT(a.closure, 0.8) << "shut";
  const auto apart = [&] {
    w.attachments(held);
    return (held[0].pose.translation() - held[1].pose.translation()).norm();
  };
  const double before = apart();
  // The vein hangs on the clip alone: what pulls at it pulls at the artery.
  in.load_over = 0.1;
  for (std::uint32_t k = 0; k < w.knotCount(1); ++k) {
    scene::KnotLoad load;
    load.object = 1, load.knot = k, load.force[2] = -0.05f / static_cast<float>(w.knotCount(1));
    load.damping = 2e-4f;
    in.loads.push_back(load);
  }
  for (int i = 0; i < 800; ++i) step();
  EXPECT_NEAR(apart(), before, 0.001);
  EXPECT_NEAR(w.reaction(0).z(), 0.05, 0.01) << "the artery's ends carry the vein";
  in.requests.push_back({scene::TopologyRequest::Kind::RemoveClip, 0, static_cast<std::uint32_t>(held[0].id),
                         Vector3d::UnitZ()});
  for (int i = 0; i < 300; ++i) step();
  EXPECT_EQ(unclipped[0] + unclipped[1], 2u);
  EXPECT_LT(w.knotAt(1, 96).z(), 0.03) << "the vein is gone with it";
}

}  // namespace
