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

TEST(Occlusion, SceneTooLargeForTheGridStaysUnshaded) {
  Store store;
  ASSERT_EQ(store.setTopology(twoSquares()), Outcome::Accepted);  // 1 m
  store.rebuildSkins();
  EXPECT_TRUE(ambientOcclusion(surfacesOf(store))[0].empty());
}

}  // namespace
}  // namespace vest::mesh
