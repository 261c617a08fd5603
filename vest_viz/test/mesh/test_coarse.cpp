#include <algorithm>
#include <atomic>
#include <cmath>
#include <map>

#include <Eigen/Geometry>

#include <gtest/gtest.h>

#include "vest_tissue/base/nearest.h"
#include "vest_viz/mesh/coarse.h"
#include "vest_viz/mesh/mark.h"

namespace vest::mesh {
namespace {

struct Sphere {
  std::vector<float> positions;
  std::vector<std::uint32_t> triangles;
  /// Rings of a globe of radius 20 mm with a seam where the texture begins, and a hole at either pole.
  Sphere() {
    constexpr std::uint32_t rings = 40, around = 80;
    for (std::uint32_t r = 0; r < rings; ++r)
      for (std::uint32_t a = 0; a <= around; ++a) {
        const double polar = 3.14159265 * (r + 1) / (rings + 1), azimuth = 2 * 3.14159265 * a / around;
        positions.insert(positions.end(), {static_cast<float>(0.02 * std::sin(polar) * std::cos(azimuth)),
                                           static_cast<float>(0.02 * std::sin(polar) * std::sin(azimuth)),
                                           static_cast<float>(0.02 * std::cos(polar))});
        const std::uint32_t v = r * (around + 1) + a;
        if (r + 1 < rings && a < around)
          triangles.insert(triangles.end(),
                           {v, v + around + 1, v + 1, v + 1, v + around + 1, v + around + 2});
      }
  }
  Eigen::Vector3d at(std::uint32_t v) const {
    return {positions[3 * v], positions[3 * v + 1], positions[3 * v + 2]};
  }
};

/// Edges with one triangle: rims and seams.
std::map<std::pair<std::uint32_t, std::uint32_t>, int> rim(const std::vector<std::uint32_t>& triangles) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
  for (std::size_t t = 0; t + 2 < triangles.size(); t += 3)
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t a = triangles[t + k], b = triangles[t + (k + 1) % 3];
      ++edges[{std::min(a, b), std::max(a, b)}];
    }
  for (auto e = edges.begin(); e != edges.end();) e = e->second == 1 ? std::next(e) : edges.erase(e);
  return edges;
}

TEST(Coarse, FarFewerTrianglesStayWithinTheToleranceOfEveryVertexOfTheSkin) {
  const Sphere s;
  constexpr double kTolerance = 0.0001;
  const std::vector<std::uint32_t> c = coarseTriangles(s.positions, s.triangles, kTolerance);
  EXPECT_LT(c.size(), s.triangles.size() / 2);
  EXPECT_GT(c.size(), 300u);
  for (std::uint32_t v = 0; v < s.positions.size() / 3; ++v) {
    double nearest = 1;
    for (std::size_t t = 0; t < c.size(); t += 3)
      nearest =
          std::min(nearest, contact::nearest(s.at(v), {s.at(c[t]), s.at(c[t + 1]), s.at(c[t + 2])}).distance);
    ASSERT_LE(nearest, 1.01 * kTolerance) << "vertex " << v;
  }
}

TEST(Coarse, RimsAndTextureSeamsKeepEveryEdge) {
  const Sphere s;
  EXPECT_EQ(rim(coarseTriangles(s.positions, s.triangles, 0.001)), rim(s.triangles));
}

TEST(Coarse, FacesStillLookOutwards) {
  const Sphere s;
  const std::vector<std::uint32_t> c = coarseTriangles(s.positions, s.triangles, 0.0005);
  for (std::size_t t = 0; t < c.size(); t += 3) {
    const Eigen::Vector3d p = s.at(c[t]), q = s.at(c[t + 1]), r = s.at(c[t + 2]);
    ASSERT_GT((q - p).cross(r - p).dot(p + q + r), 0.0) << "triangle " << t / 3;
  }
}

// Protects a waist that a sling or a clip draws from vanishing between the few vertices of a straight tube.
TEST(Coarse, AWaistOfAStraightTubeIsTold) {
  constexpr std::uint32_t rings = 40, around = 24;
  const auto tube = [&](double waist, const Eigen::Affine3d& moved) {
    std::vector<float> positions;
    for (std::uint32_t r = 0; r < rings; ++r)
      for (std::uint32_t a = 0; a < around; ++a) {
        const double angle = 2 * 3.14159265 * a / around, radius = r == 20 ? 0.0035 - waist : 0.0035;
        const Eigen::Vector3d p =
            moved * Eigen::Vector3d(radius * std::cos(angle), radius * std::sin(angle), 0.001 * r);
        for (int k = 0; k < 3; ++k) positions.push_back(static_cast<float>(p[k]));
      }
    return positions;
  };
  std::vector<std::uint32_t> triangles;
  for (std::uint32_t r = 0; r + 1 < rings; ++r)
    for (std::uint32_t a = 0; a < around; ++a) {
      const std::uint32_t v = r * around + a, w = r * around + (a + 1) % around;
      triangles.insert(triangles.end(), {v, w, v + around, w, w + around, v + around});
    }
  constexpr double kTolerance = 0.0001;
  const std::vector<float> rest = tube(0, Eigen::Affine3d::Identity());
  const std::vector<std::uint32_t> c = coarseTriangles(rest, triangles, kTolerance);
  const std::vector<LeftOut> l = leftOut(rest, triangles, c, nullptr);
  std::vector<bool> named(rest.size() / 3, false);
  for (const std::uint32_t v : c) named[v] = true;
  EXPECT_EQ(l.size(), static_cast<std::size_t>(std::count(named.begin(), named.end(), false)));
  ASSERT_FALSE(l.empty());
  EXPECT_LE(greatestGap(l, rest), 1.01f * static_cast<float>(kTolerance));
  Eigen::Affine3d moved(Eigen::AngleAxisd(1.1, Eigen::Vector3d(1, 2, -1).normalized()));
  moved.pretranslate(Eigen::Vector3d(0.03, -0.02, 0.05));
  EXPECT_LE(greatestGap(l, tube(0, moved)), 2.02f * static_cast<float>(kTolerance)) << "a motion is no bend";
  EXPECT_GT(greatestGap(l, tube(0.0015, moved)), 0.0008f);
  const std::atomic<bool> stop{true};
  EXPECT_TRUE(leftOut(rest, triangles, c, &stop).empty());
}

TEST(Coarse, WhatIsNoSurfaceComesBackAsItIs) {
  const std::vector<float> p{0, 0, 0, 1, 0, 0, 0, 1, 0, 0, -1, 0, 0, 0, 1};
  const std::vector<std::uint32_t> three_at_an_edge{0, 1, 2, 1, 0, 3, 0, 1, 4};
  EXPECT_EQ(coarseTriangles(p, three_at_an_edge, 0.1), three_at_an_edge);
  EXPECT_TRUE(coarseTriangles({}, {}, 0.1).empty());
}

TEST(Coarse, WhatLiesNextToASharpEdgeStays) {
  std::vector<float> positions;
  std::vector<std::uint32_t> triangles;
  constexpr std::uint32_t n = 20;
  const auto index = [](std::uint32_t i, std::uint32_t j) { return j * (n + 1) + i; };
  for (std::uint32_t j = 0; j <= n; ++j)
    for (std::uint32_t i = 0; i <= n; ++i) {
      // A sheet that is bent down by 90 degrees along its middle.
      const float x = 0.001f * static_cast<float>(i) - 0.01f;
      positions.insert(positions.end(),
                       {std::min(x, 0.0f), 0.001f * static_cast<float>(j), -std::max(x, 0.0f)});
      if (i < n && j < n)
        triangles.insert(triangles.end(), {index(i, j), index(i + 1, j), index(i + 1, j + 1), index(i, j),
                                           index(i + 1, j + 1), index(i, j + 1)});
    }
  const std::vector<std::uint32_t> coarse = coarseTriangles(positions, triangles, 0.0001);
  EXPECT_LT(coarse.size(), 3 * triangles.size() / 4) << "what is flat is drawn with fewer";
  const auto kept = [&](std::uint32_t v) {
    return std::find(coarse.begin(), coarse.end(), v) != coarse.end();
  };
  for (std::uint32_t j = 1; j < n; ++j)
    for (std::uint32_t i : {n / 2 - 1, n / 2, n / 2 + 1}) EXPECT_TRUE(kept(index(i, j))) << i << " " << j;
}

TEST(Coarse, ADarkVertexDoesNotStandForABrightSurface) {
  // One bright vertex was left out in the middle of a triangle with a dark corner.
  const std::vector<LeftOut> left_out{{3, {0, 1, 2}, {1.0f / 3, 1.0f / 3, 1.0f / 3}}};
  const std::vector<float> drawn = coarseValues(left_out, {0.1f, 0.9f, 0.9f, 0.9f});
  EXPECT_NEAR(drawn[0], (0.1f + 0.3f) / (4.0f / 3), 1e-6);
  EXPECT_NEAR(drawn[1], 0.9f, 1e-6);
  EXPECT_EQ(coarseValues({}, {0.5f}), std::vector<float>{0.5f});
}

TEST(Mark, ABeatThatCrossesTheLeastMarkBuildsNoMeshAgain) {
  Mark mark;
  int built = 0;
  EXPECT_FALSE(mark.look(0));
  for (int i = 0; i < 1000; ++i) built += mark.look(i % 10 < 5 ? 1.1f * Mark::kLeast : 0.9f * Mark::kLeast);
  EXPECT_EQ(built, 1);
  for (int i = 0; i < 2 * Mark::kWait; ++i) built += mark.look(0);
  EXPECT_EQ(built, 2);
  EXPECT_FALSE(mark.on());
}

}  // namespace
}  // namespace vest::mesh
