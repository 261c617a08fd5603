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

TEST(Occlusion, SceneTooLargeForTheGridStaysUnshaded) {
  Store store;
  ASSERT_EQ(store.setTopology(twoSquares()), Outcome::Accepted);  // 1 m
  store.rebuildSkins();
  EXPECT_TRUE(ambientOcclusion(surfacesOf(store))[0].empty());
}

}  // namespace
}  // namespace vest::mesh
