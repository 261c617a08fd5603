#include <set>
#include <string>

#include <gtest/gtest.h>

#include "vest_instruments/tools/tool_geometry.h"

namespace {

using namespace vest::tools;

// Protects: names in YAML, URDF and services mean one kind each, both ways.
TEST(Tools, EveryKindHasANameOfItsOwnThatLeadsBackToIt) {
  std::set<std::string> seen;
  for (int i = 0; i < kToolKindCount; ++i) {
    const auto kind = static_cast<ToolKind>(i);
    EXPECT_TRUE(seen.insert(std::string(toolName(kind))).second) << toolName(kind);
    ASSERT_TRUE(toolFromName(toolName(kind)).has_value());
    EXPECT_EQ(*toolFromName(toolName(kind)), kind);
    EXPECT_EQ(toolGeometry(kind).kind, kind);
  }
  EXPECT_FALSE(toolFromName("spoon").has_value());
  EXPECT_FALSE(toolFromName("").has_value());
  EXPECT_EQ(toolFromName("clip_applier"), ToolKind::ClipApplier);
}

// Protects: measured_cp is the point of the closed jaws, so geometry must end at the tip frame's origin.
TEST(Tools, ClosedJawsEndAtTheTipAndDoNotPassThroughEachOther) {
  int with_jaws = 0;
  for (int i = 0; i < kToolKindCount; ++i) {
    const ToolGeometry& tool = toolGeometry(static_cast<ToolKind>(i));
    if (tool.jaw_length == 0.0) {
      EXPECT_TRUE(tool.jaw[0].empty() && tool.jaw[1].empty());
      EXPECT_EQ(tool.max_jaw_angle, 0.0);
      continue;
    }
    ++with_jaws;
    EXPECT_GT(tool.max_jaw_angle, 0.3);
    EXPECT_LE(tool.max_jaw_angle, 1.2);
    for (int side = 0; side < 2; ++side) {
      double end = 0.0;
      for (const Capsule& c : tool.jaw[side]) {
        end = std::max({end, c.a.z() + c.radius, c.b.z() + c.radius});
        const double s = side == 0 ? 1.0 : -1.0;
        EXPECT_GE(s * c.a.x() - c.radius, -1e-12);
        EXPECT_GE(s * c.b.x() - c.radius, -1e-12);
        EXPECT_LE(s * c.a.x() + c.radius, tool.shaft_radius + 1e-4) << "closed jaws must pass the trocar";
      }
      EXPECT_NEAR(end, tool.jaw_length, 1e-12);
    }
    EXPECT_EQ(tool.interaction_points.size(), 4u);
    EXPECT_TRUE(tool.interaction_points[0].isZero());
  }
  EXPECT_EQ(with_jaws, 5);
}

TEST(Tools, WorkingToolsHaveFourInteractionPointsOnTheirSurfaceOrAxis) {
  for (const ToolKind kind : {ToolKind::CoagulationHook, ToolKind::SuctionIrrigator,
                              ToolKind::InjectionNeedle, ToolKind::SlingApplicator, ToolKind::Swab}) {
    EXPECT_EQ(toolGeometry(kind).interaction_points.size(), 4u) << toolName(kind);
  }
  EXPECT_TRUE(toolGeometry(ToolKind::None).fixed.empty());
  EXPECT_DOUBLE_EQ(toolGeometry(ToolKind::Endoscope).shaft_radius, 0.005);
}

}  // namespace
