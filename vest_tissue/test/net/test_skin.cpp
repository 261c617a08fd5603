#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "vest_tissue/net/skin.h"

TEST(Skin, VerticesAreTheWeightedMeansOfTheirKnots) {
  const std::array<float, 9> knots{0, 0, 0, 1, 0, 0, 0, 2, 0};
  const std::array<std::uint32_t, 3> start{0, 1, 4};
  const std::array<std::uint32_t, 4> bound{1, 0, 1, 2};
  const std::array<float, 4> weights{1.0f, 0.25f, 0.25f, 0.5f};
  std::array<float, 6> out{};
  vest::net::rebuildSkin(knots.data(), start.data(), bound.data(), weights.data(), 2, out.data());
  EXPECT_FLOAT_EQ(out[0], 1.0f);
  EXPECT_FLOAT_EQ(out[3], 0.25f);
  EXPECT_FLOAT_EQ(out[4], 1.0f);
}

TEST(Skin, NormalsPointOutOfCounterClockwiseTrianglesAndHaveLengthOne) {
  const std::array<float, 12> positions{0, 0, 0, 1, 0, 0, 0, 1, 0, 5, 5, 5};
  const std::array<std::uint32_t, 3> triangle{0, 1, 2};
  std::array<float, 12> normals{};
  vest::net::vertexNormals(positions.data(), 4, triangle.data(), 1, normals.data());
  for (int v = 0; v < 3; ++v) EXPECT_FLOAT_EQ(normals[3 * v + 2], 1.0f);
  EXPECT_FLOAT_EQ(normals[11], 1.0f) << "a vertex without area gets 0 0 1";
}
