#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include <Eigen/Geometry>

#include <gtest/gtest.h>

#include "sample.h"
#include "vest_viz/mesh/occlusion.h"

namespace vest::mesh {
namespace {

/// A floor of 21 × 21 vertices, 5 mm apart, at height z, facing up.
Object floorAt(const std::string& name, float z) {
  Object o;
  o.name = name;
  const std::uint32_t n = 21;
  o.binding_start = {0};
  for (std::uint32_t y = 0; y < n; ++y)
    for (std::uint32_t x = 0; x < n; ++x) {
      o.rest_position.insert(o.rest_position.end(), {0.005f * x, 0.005f * y, z});
      o.binding_knots.push_back(y * n + x);
      o.binding_weights.push_back(1);
      o.binding_start.push_back(o.binding_start.back() + 1);
      if (x + 1 < n && y + 1 < n)
        for (std::uint32_t i : {0u, 1u, n + 1, 0u, n + 1, n}) o.triangles.push_back(y * n + x + i);
    }
  o.knot_count = n * n;
  return o;
}

TEST(Occlusion, OpenFloorIsOpenAndAFloorUnderALidIsNot) {
  const std::size_t middle = 10 * 21 + 10;
  Topology open;
  open.objects = {floorAt("floor", 0.0f), floorAt("far", 0.2f)};
  Store store;
  ASSERT_EQ(store.setTopology(open), Outcome::Accepted) << store.problem();
  store.rebuildSkins();
  EXPECT_GT(ambientOcclusion(surfacesOf(store))[0][middle], 0.95f);
  Topology covered;
  covered.objects = {floorAt("floor", 0.0f), floorAt("lid", 0.008f)};
  ASSERT_EQ(store.setTopology(covered), Outcome::Accepted) << store.problem();
  store.rebuildSkins();
  EXPECT_LT(ambientOcclusion(surfacesOf(store))[0][middle], 0.75f);
  EXPECT_GT(ambientOcclusion(surfacesOf(store))[1][middle], 0.95f);
}

TEST(Occlusion, WhatLiesOnAFloorDarkensIt) {
  // Nearer than the grid can tell apart: a vessel on the wall would seem to hang before it.
  Topology t;
  t.objects = {floorAt("floor", 0.0f), floorAt("lid", 0.003f)};
  for (std::size_t k = 0; k < t.objects[1].rest_position.size(); k += 3)
    t.objects[1].rest_position[k] = 0.045f + 0.1f * t.objects[1].rest_position[k];  // 10 mm wide
  Store store;
  ASSERT_EQ(store.setTopology(t), Outcome::Accepted) << store.problem();
  store.rebuildSkins();
  const std::vector<float> open = ambientOcclusion(surfacesOf(store))[0];
  EXPECT_LT(open[10 * 21 + 10], 0.5f) << "in the middle below it";
  EXPECT_GT(open[10 * 21 + 2], 0.9f) << "3 cm beside it";
}

TEST(Occlusion, AWallIsFinerWhereAVesselLiesInItSoThatTheSeamIsANarrowDarkLine) {
  // A wall's vertices stand 5 mm apart, the seam is a millimetre wide: between them it was not seen.
  Topology t;
  t.objects = {floorAt("floor", 0.0f), floorAt("vessel", 0.0f)};
  for (std::size_t k = 0; k < t.objects[1].rest_position.size(); k += 3) {  // half a tube of 5 mm, along y
    const float angle = 31.4159265f * t.objects[1].rest_position[k];
    t.objects[1].rest_position[k] = 0.0525f - 0.005f * std::cos(angle);
    t.objects[1].rest_position[k + 2] = 0.005f * std::sin(angle);
  }
  Store store;
  ASSERT_EQ(store.setTopology(t), Outcome::Accepted) << store.problem();
  store.rebuildSkins();
  std::vector<Surface> surfaces = surfacesOf(store);
  Surface& floor = surfaces[0];
  const std::size_t before = floor.positions.size() / 3;
  const Refined refined = refineForContact(surfaces, 0);
  refined.append(3, &floor.positions);
  refined.append(3, &floor.normals);
  floor.triangles = refined.triangles;
  EXPECT_GT(refined.middles.size(), 500u);
  EXPECT_LT(refined.middles.size(), 5000u) << "the rest of the wall stays as it is";
  const auto at = [&](std::uint32_t v) {
    return Eigen::Map<const Eigen::Vector3f>(&floor.positions[3 * static_cast<std::size_t>(v)]);
  };
  // No cracks: every edge has two triangles, but for those of the floor's rim.
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
  for (std::size_t k = 0; k < floor.triangles.size(); k += 3) {
    const std::uint32_t* v = &floor.triangles[k];
    ASSERT_GT((at(v[1]) - at(v[0])).cross(at(v[2]) - at(v[0])).z(), 0.0f) << "still looks up";
    for (std::size_t c = 0; c < 3; ++c)
      ++edges[{std::min(v[c], v[(c + 1) % 3]), std::max(v[c], v[(c + 1) % 3])}];
  }
  for (const auto& [edge, count] : edges) {
    const Eigen::Vector3f a = at(edge.first), b = at(edge.second), middle = 0.5f * (a + b);
    const bool rim = (middle.head<2>().array() < 0.0001f).any() || (middle.head<2>().array() > 0.0999f).any();
    ASSERT_EQ(count, rim ? 1 : 2) << a.transpose() << " to " << b.transpose();
    if (std::fabs(middle.x() - 0.0475f) < 0.004f) {
      ASSERT_LT((a - b).norm(), 0.0026f) << "beside the vessel";
    }
  }
  const std::vector<float> open = ambientOcclusion(surfaces)[0];
  ASSERT_EQ(open.size(), before + refined.middles.size());
  for (float y = 0.03f; y < 0.07f; y += 0.0025f) {
    float darkest = 1;
    for (std::uint32_t v = 0; v < open.size(); ++v)
      if (std::fabs(at(v).y() - y) < 0.0015f && std::fabs(at(v).x() - 0.0465f) < 0.0012f)
        darkest = std::min(darkest, open[v]);
    EXPECT_LT(darkest, 0.75f) << "the line is unbroken: y = " << y;
  }
  for (std::uint32_t v = 0; v < open.size(); ++v)
    if (at(v).x() > 0.03f && at(v).x() < 0.0375f) {
      ASSERT_GT(open[v], 0.85f) << "a centimetre beside it";
    }
}

TEST(Occlusion, SceneTooLargeForTheGridStaysUnshaded) {
  Store store;
  ASSERT_EQ(store.setTopology(twoSquares()), Outcome::Accepted);  // 1 m
  store.rebuildSkins();
  EXPECT_TRUE(ambientOcclusion(surfacesOf(store))[0].empty());
}

}  // namespace
}  // namespace vest::mesh
