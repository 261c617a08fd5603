// The wall of a cut through elements is drawn smooth, alike on both sides, and loose slivers are left out.
// End faces bear a texture.
#include <algorithm>
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
  /// Each vertex hangs on a knot of its own.
  Object object() const {
    Object o;
    o.triangles = triangles, o.triangle_layer = layer;
    o.knot_count = static_cast<std::uint32_t>(vertices());
    o.rest_position = positions;
    o.binding_start.push_back(0);
    for (std::uint32_t v = 0; v < o.knot_count; ++v) {
      o.binding_knots.push_back(v), o.binding_weights.push_back(1.0f);
      o.binding_start.push_back(v + 1);
    }
    return o;
  }
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
  cut.build(wall.object());
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
  cut.build(wall.object());
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
  cut.build(wall.object());
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
  cut.build(wall.object());
  ASSERT_EQ(cut.dropped().size(), 4u);
  EXPECT_EQ(cut.dropped().front(), whole) << "the wall itself stays";
  // Skin that is embedded has vertices of its own, and hangs on the same knots as its wall.
  Object one = wall.object();
  for (std::uint32_t k = 0; k < 4; ++k) one.binding_knots[first + k] = k;
  cut.build(one);
  EXPECT_TRUE(cut.dropped().empty())
      << "a wall of few triangles is no piece where its skin hangs on its knots";
}

/// A sheet's top and the face at its end, 6 mm high, whose lower vertices have the coordinates of the rim
/// above them.
TEST(Caps, TheEndFaceOfASheetHasItsOwnTexture) {
  constexpr std::uint32_t kAcross = 8, kRows = 4;
  Object o;
  o.name = o.organ = "liver";
  o.binding_start.push_back(0);
  for (std::uint32_t row = 0; row <= kRows; ++row)  // the last one lies below the first
    for (std::uint32_t k = 0; k <= kAcross; ++k) {
      const bool below = row == kRows;
      const float x = 0.002f * static_cast<float>(k), y = below ? 0.0f : 0.006f * static_cast<float>(row);
      o.rest_position.insert(o.rest_position.end(), {x, y, below ? -0.006f : 0.0f});
      o.texture_coordinates.insert(o.texture_coordinates.end(), {y, x});
      o.binding_knots.push_back(o.knot_count), o.binding_weights.push_back(1.0f);
      o.binding_start.push_back(++o.knot_count);
    }
  const auto quad = [&o](std::uint32_t a, std::uint32_t b) {
    for (std::uint32_t k = 0; k < kAcross; ++k)
      o.triangles.insert(o.triangles.end(), {a + k, a + k + 1, b + k + 1, a + k, b + k + 1, b + k});
  };
  for (std::uint32_t row = 0; row + 1 < kRows; ++row) quad(row * (kAcross + 1), (row + 1) * (kAcross + 1));
  const std::size_t top = o.triangles.size();
  quad(kRows * (kAcross + 1), 0);
  Store store;
  Topology t;
  t.objects = {o};
  ASSERT_EQ(store.setTopology(t), Outcome::Accepted);
  const Skin& skin = store.skin(0);
  EXPECT_TRUE(std::equal(o.triangles.begin(), o.triangles.begin() + static_cast<std::ptrdiff_t>(top),
                         skin.triangles.begin()));
  EXPECT_TRUE(std::equal(o.texture_coordinates.begin(), o.texture_coordinates.end(), skin.uv.begin()));
  for (std::size_t i = top; i < skin.triangles.size(); i += 3) {
    const std::uint32_t* c = &skin.triangles[i];
    const auto d = [&](std::size_t k, std::size_t axis) {
      return skin.uv[2 * c[k] + axis] - skin.uv[2 * c[0] + axis];
    };
    EXPECT_NEAR(std::fabs(d(1, 0) * d(2, 1) - d(1, 1) * d(2, 0)), 0.002f * 0.006f, 0.25f * 0.002f * 0.006f)
        << "m2: as large as the triangle's face, twice";
  }
}

}  // namespace
}  // namespace vest::mesh
