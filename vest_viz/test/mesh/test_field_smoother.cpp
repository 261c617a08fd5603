// A field that knots carry is drawn without their grid.
#include <algorithm>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "vest_viz/mesh/field_smoother.h"

namespace vest::mesh {
namespace {

constexpr std::uint32_t kSide = 41;      // vertices, 1 mm apart
constexpr float kKnotDistance = 0.004f;  // m: every fourth vertex is a knot

struct Skin {
  std::vector<float> positions;
  std::vector<std::uint32_t> triangles;
  Skin() {
    for (std::uint32_t j = 0; j < kSide; ++j)
      for (std::uint32_t i = 0; i < kSide; ++i) {
        positions.insert(positions.end(),
                         {0.001f * static_cast<float>(i), 0.001f * static_cast<float>(j), 0});
        const std::uint32_t k = j * kSide + i;
        if (i + 1 < kSide && j + 1 < kSide)
          triangles.insert(triangles.end(), {k, k + 1, k + kSide + 1, k, k + kSide + 1, k + kSide});
      }
  }
};

/// Linear between knots at which it is 0 or 255, by turns along x.
std::uint8_t zigzag(std::uint32_t i) {
  const double t = (i % 8) / 4.0;
  return static_cast<std::uint8_t>(255 * (t < 1 ? t : 2 - t));
}

TEST(FieldSmoother, TheGridOfTheKnotsIsGone) {
  const Skin skin;
  std::vector<std::uint8_t> values(kSide * kSide);
  for (std::uint32_t v = 0; v < values.size(); ++v) values[v] = zigzag(v % kSide);
  FieldSmoother smoother;
  smoother.build(skin.triangles, skin.positions, kKnotDistance);
  EXPECT_GT(smoother.passes(), 4);
  smoother.smooth(values.data(), 1);
  std::uint8_t low = 255, high = 0;
  for (std::uint32_t i = 8; i < kSide - 8; ++i) {
    low = std::min(low, values[20 * kSide + i]);
    high = std::max(high, values[20 * kSide + i]);
  }
  EXPECT_LT(high - low, 160) << "of 255 that it came with, at twice the pitch of the grid";
  EXPECT_NEAR(0.5 * (low + high), 127.5, 20) << "none of it is lost";
}

TEST(FieldSmoother, WhatIsTheSameEverywhereStays) {
  const Skin skin;
  FieldSmoother smoother;
  smoother.build(skin.triangles, skin.positions, kKnotDistance);
  std::vector<std::uint8_t> values(4 * kSide * kSide, 7);
  for (std::size_t v = 0; v < values.size(); v += 4) values[v] = 200;
  const std::vector<std::uint8_t> before = values;
  smoother.smooth(values.data(), 4);
  EXPECT_EQ(values, before) << "and the fields beside it, too";
}

TEST(FieldSmoother, ASkinAsCoarseAsItsKnotsIsSmoothedLittle) {
  const Skin skin;
  FieldSmoother smoother;
  smoother.build(skin.triangles, skin.positions, 0.001f);
  EXPECT_LE(smoother.passes(), 1);
}

}  // namespace
}  // namespace vest::mesh
