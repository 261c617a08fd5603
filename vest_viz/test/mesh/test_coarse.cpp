#include <algorithm>
#include <cmath>
#include <map>

#include <Eigen/Geometry>

#include <gtest/gtest.h>

#include "vest_tissue/contact/contacts.h"
#include "vest_viz/mesh/coarse.h"

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

TEST(Coarse, WhatIsNoSurfaceComesBackAsItIs) {
  const std::vector<float> p{0, 0, 0, 1, 0, 0, 0, 1, 0, 0, -1, 0, 0, 0, 1};
  const std::vector<std::uint32_t> three_at_an_edge{0, 1, 2, 1, 0, 3, 0, 1, 4};
  EXPECT_EQ(coarseTriangles(p, three_at_an_edge, 0.1), three_at_an_edge);
  EXPECT_TRUE(coarseTriangles({}, {}, 0.1).empty());
}

}  // namespace
}  // namespace vest::mesh
