#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <vector>

#include "vest_bringup/ros/field_messages.h"
#include "vest_effects/fluid/drawn_pools.h"

// Protects how pools are seen: from shore to shore under organs, and without holes.

namespace vest::simulation {
namespace {

/// A cavity without tissue, dry.
struct Cavity : FieldFrame {
  Cavity() {
    fluid_model = std::make_shared<const fluid::Model>(fluid::buildModel({}, {}));
    fluid = fluid::initialState(*fluid_model);
  }
  std::size_t at(int column, int row) const {
    return static_cast<std::size_t>(row * fluid_model->columns + column);
  }
};

TEST(DrawnPools, APoolsSurfaceGoesOnUnderAnOrganThatSpansIt) {
  Cavity frame;
  fluid::Pools& w = frame.fluid.pools;
  for (int r = 30; r < 42; ++r) {
    for (int c = 20; c < 40; ++c) {
      const bool organ = c >= 28 && c < 31, step = c >= 36;  // 12 mm wide, 20 mm above; a shore, 1 mm above
      w.bed[frame.at(c, r)] = organ ? 0.025f : step ? 0.006f : 0.0f;
      w.depth[frame.at(c, r)] = organ || step ? 0.0f : 0.005f;
    }
  }
  vest_msgs::FluidState msg;
  ros_shell::toMsg(frame, msg);
  // From above two pools; what is drawn of them leaves no gap under the organ, and ends at the shore.
  double volume = 0;
  std::vector<int> covered(static_cast<std::size_t>(frame.fluid_model->columns), 0);
  for (const auto& pool : msg.pools) {
    volume += pool.volume;
    const int first = static_cast<int>(
        std::lround((pool.origin.position.x - frame.fluid_model->parameters.low[0]) / pool.cell));
    for (std::size_t k = 0; k < pool.height.size(); ++k) {
      if (std::isnan(pool.height[k])) continue;
      ++covered[static_cast<std::size_t>(first) + k % pool.columns];
      EXPECT_EQ(pool.depth[k], 50) << "also under the organ: as deep as beside it, in 0.1 mm";
      EXPECT_NEAR(pool.origin.position.z + static_cast<double>(pool.height[k]), 0.005, 1e-6);
    }
  }
  for (int c = 20; c < 36; ++c) EXPECT_EQ(covered[static_cast<std::size_t>(c)], 12) << "column " << c;
  EXPECT_EQ(covered[36], 0);
  EXPECT_NEAR(volume, 13 * 12 * 1.6e-5 * 0.005, 1e-9) << "m³: what is drawn under the organ does not count";
}

TEST(DrawnPools, APoolsSurfaceGoesOnUnderTheRimOfAnOrganThatHangsOverIt) {
  // Or it would end in a straight line along the rim, in sight of who looks under it.
  Cavity frame;
  fluid::Pools& w = frame.fluid.pools;
  for (int r = 30; r < 42; ++r) {
    for (int c = 20; c < 42; ++c) {
      const bool organ = c >= 27 && c < 39;  // 48 mm wide, 20 mm above
      w.bed[frame.at(c, r)] = organ ? 0.025f : 0.0f;
      w.depth[frame.at(c, r)] = organ ? 0.0f : 0.005f;
    }
  }
  const fluid::DrawnPools drawn = fluid::drawnPools(*frame.fluid_model, frame.fluid);
  for (int c = 20; c < 42; ++c) {
    const float top = drawn.surface[frame.at(c, 35)];
    if (c > 30 && c < 35) {
      EXPECT_TRUE(std::isnan(top)) << "column " << c;
    } else {
      EXPECT_NEAR(top, 0.005f, 1e-6f) << "column " << c;
      EXPECT_NEAR(fluid::drawnDepth(*frame.fluid_model, w, drawn, frame.at(c, 35)), 0.005f, 1e-6f);
    }
  }
  ASSERT_EQ(drawn.patches.size(), 2U);
  EXPECT_EQ(drawn.patches[0].columns, 7 + 4);
}

TEST(DrawnPools, AWellThatAnOrganHasLaidBareIsNoHoleInThePool) {
  Cavity frame;
  fluid::Pools& w = frame.fluid.pools;
  for (int r = 30; r < 42; ++r) {
    for (int c = 20; c < 40; ++c) {
      const bool organ = c == 28 || c == 29;
      w.bed[frame.at(c, r)] = organ ? 0.025f : 0.0f;
      w.depth[frame.at(c, r)] = organ ? 0.0f : 0.010f;
    }
  }
  for (const int r : {34, 35}) w.bed[frame.at(28, r)] = 0;         // it bends to the right there
  w.depth[frame.at(28, 34)] = 0.002f;                              // and water begins to fall in
  for (const int c : {35, 36}) w.depth[frame.at(c, 36)] = 0.004f;  // a wave's trough far from it stays
  vest_msgs::FluidState msg;
  ros_shell::toMsg(frame, msg);
  ASSERT_EQ(msg.pools.size(), 1u);
  const vest_msgs::FluidPool& pool = msg.pools[0];
  const int c0 = static_cast<int>(
                std::lround((pool.origin.position.x - frame.fluid_model->parameters.low[0]) / pool.cell)),
            r0 = static_cast<int>(
                std::lround((pool.origin.position.y - frame.fluid_model->parameters.low[1]) / pool.cell));
  const auto drawn = [&](int c, int r) {
    const auto k = static_cast<std::size_t>(r - r0) * pool.columns + static_cast<std::size_t>(c - c0);
    EXPECT_EQ(pool.depth[k],
              std::lround(1e4 * (pool.origin.position.z + static_cast<double>(pool.height[k]))))
        << "as deep as it is drawn";
    return pool.origin.position.z + static_cast<double>(pool.height[k]);
  };
  EXPECT_NEAR(drawn(28, 34), 0.010, 1e-6);
  EXPECT_NEAR(drawn(28, 35), 0.010, 1e-6) << "dry still";
  EXPECT_NEAR(drawn(35, 36), 0.004, 1e-6);
  EXPECT_NEAR(pool.volume, fluid::poolVolume(*frame.fluid_model, frame.fluid), 1e-9) << "no drop more";
}

}  // namespace
}  // namespace vest::simulation
