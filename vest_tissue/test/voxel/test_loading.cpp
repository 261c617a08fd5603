// Protects the hand from tables and images that are too steep, and from ones that say nothing.
#include <gtest/gtest.h>

#include "blocks.h"

using namespace vest;
using namespace vest::voxel;
using namespace vest::voxel::testing;

namespace {

const auto edge = [](double z) { return z < -0.02 ? 200 : z < 0 ? 100 : 0; };

std::string refusal(const volume::TransferTable& table) {
  try {
    makeFeelable(layers(edge), table, options());
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "";
}

}  // namespace

TEST(Loading, WhatIsTooSteepIsSmoothedMoreAndSaid) {
  const auto gentle = makeFeelable(layers(edge), table({1, 0.4, 0, 0}, {1, 1.4, 0, 0}), options());
  EXPECT_TRUE(gentle->notes.empty());
  EXPECT_NEAR(gentle->smoothing, 0.001, 1e-12);
  auto within = table({1, 0.1, 0, 0}, {1, 3.2, 0, 0});
  within[2].value = 146, within[3].value = 154;
  const auto steep = makeFeelable(layers(edge), within, options());
  EXPECT_GT(steep->smoothing, 0.001);
  EXPECT_LE(steep->steepest, 0.04);
  ASSERT_EQ(steep->notes.size(), 1u);
  EXPECT_NE(steep->notes[0].find("smoothed over"), std::string::npos) << steep->notes[0];
}

TEST(Loading, RefusesTablesThatNoHandCanBear) {
  auto tight = table({1, 0.1, 0, 0}, {1, 3.2, 0, 0});
  tight[2].value = 149, tight[3].value = 150;
  EXPECT_NE(refusal(tight).find("too steep"), std::string::npos);
  auto airy = table({1, 1, 0, 0}, {1, 1, 0, 0});
  airy[0].feel[1] = 0.1;
  EXPECT_NE(refusal(airy).find("first row"), std::string::npos);
  EXPECT_NE(refusal(table({0, 0, 0, 0}, {0, 0, 0, 0})).find("columns"), std::string::npos);
}

TEST(Loading, TheSmoothedCopyStaysWithin64Megabytes) {
  auto large = layers(edge);
  large.axes *= 8;  // 480 × 480 × 640 mm
  const auto made = makeFeelable(large, table({1, 0.4, 0, 0}, {1, 1.0, 0, 0}), options());
  EXPECT_LE(3 * made->stored.size(), std::size_t{64} << 20);
  EXPECT_GT(made->spacing, 0.001);
  ASSERT_FALSE(made->notes.empty());
}
