// The wall of a cut through elements is drawn smooth, alike on both sides, and loose slivers are left out.
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "vest_viz/mesh/cut_surface.h"
#include "vest_viz/mesh/store.h"

namespace vest::mesh {
namespace {

constexpr float kEdge = 0.005f;  // m

/// A wall of n by n squares in the plane z = 0 that a cut along element faces left jagged: every other vertex
/// stands out by half an edge.
struct Wall {
  static constexpr std::uint32_t n = 8;
  std::vector<float> positions;
  std::vector<std::uint32_t> triangles;
  std::vector<std::uint16_t> layer;

  Wall() {
    for (std::uint32_t j = 0; j <= n; ++j)
      for (std::uint32_t i = 0; i <= n; ++i) {
        positions.insert(positions.end(), {kEdge * static_cast<float>(i), kEdge * static_cast<float>(j),
                                           (i + j) % 2 == 0 ? 0.0f : 0.5f * kEdge});
        if (i == n || j == n) continue;
        const std::uint32_t k = j * (n + 1) + i, up = k + n + 1;
        triangles.insert(triangles.end(), {k, k + 1, up + 1, k, up + 1, up});
        layer.insert(layer.end(), {kCutFace, kCutFace});
      }
  }
  std::size_t vertices() const { return positions.size() / 3; }
  /// Deviation of z inside, over that of what came in.
  double roughness() const {
    double sum = 0, squares = 0;
    int count = 0;
    for (std::uint32_t j = 2; j + 1 < n; ++j)
      for (std::uint32_t i = 2; i + 1 < n; ++i, ++count) {
        const double z =
            static_cast<double>(positions[3 * (j * (n + 1) + i) + 2]) / static_cast<double>(kEdge);
        sum += z, squares += z * z;
      }
    return std::sqrt(squares / count - sum / count * sum / count) / 0.25;
  }
};

TEST(CutSurface, TheJaggedWallOfACutIsDrawnSmooth) {
  Wall wall;
  CutSurface cut;
  cut.build(wall.triangles, wall.layer, wall.vertices());
  const std::vector<float> before = wall.positions;
  cut.smooth(wall.positions.data());
  EXPECT_LT(wall.roughness(), 0.15);
  for (std::size_t k = 0; k < before.size(); ++k)
    EXPECT_LT(std::fabs(wall.positions[k] - before[k]), kEdge) << "and stays where it was";
}

TEST(CutSurface, SkinThatNothingCutStaysToTheBit) {
  Wall wall;
  wall.layer.assign(wall.layer.size(), kOuterSkin);
  const std::vector<float> before = wall.positions;
  CutSurface cut;
  cut.build(wall.triangles, wall.layer, wall.vertices());
  EXPECT_TRUE(cut.empty());
  cut.smooth(wall.positions.data());
  EXPECT_EQ(wall.positions, before);
}

TEST(CutSurface, BothSidesOfAClosedCutLieOnEachOther) {
  // The second side has vertices of its own and looks the other way.
  Wall wall;
  const auto count = static_cast<std::uint32_t>(wall.vertices());
  const std::size_t one = wall.triangles.size();
  wall.positions.insert(wall.positions.end(), wall.positions.begin(), wall.positions.end());
  for (std::size_t t = 0; t < one; t += 3)
    for (std::size_t k : {0u, 2u, 1u}) wall.triangles.push_back(wall.triangles[t + k] + count);
  wall.layer.resize(wall.triangles.size() / 3, kCutFace);
  CutSurface cut;
  cut.build(wall.triangles, wall.layer, wall.vertices());
  cut.smooth(wall.positions.data());
  for (std::size_t k = 0; k < 3 * count; ++k)
    EXPECT_NEAR(wall.positions[k], wall.positions[k + 3 * count], 1e-6f);
}

TEST(CutSurface, AnElementThatCameLooseIsNotDrawn) {
  Wall wall;
  const auto first = static_cast<std::uint32_t>(wall.vertices());
  wall.positions.insert(wall.positions.end(), {0, 0, 0.1f, 0.004f, 0, 0.1f, 0, 0.004f, 0.1f, 0, 0, 0.104f});
  for (std::uint32_t k : {0u, 2u, 1u, 0u, 1u, 3u, 1u, 2u, 3u, 2u, 0u, 3u})
    wall.triangles.push_back(first + k);
  const std::size_t whole = wall.layer.size();
  wall.layer.resize(whole + 4, kCutFace);
  CutSurface cut;
  cut.build(wall.triangles, wall.layer, wall.vertices());
  ASSERT_EQ(cut.dropped().size(), 4u);
  EXPECT_EQ(cut.dropped().front(), whole) << "the wall itself stays";
}

}  // namespace
}  // namespace vest::mesh
