// Protects the message about objects that would fall for ever.
#include <gtest/gtest.h>

#include "vest_tissue/scene/falling.h"

namespace {

using namespace vest::scene;

/// A small tetrahedron of four knots at a height.
Object body(const std::string& name, double z, double size = 0.01) {
  Object o;
  o.name = name;
  o.position = {{0, 0, z}, {size, 0, z}, {0, size, z}, {0.2 * size, 0.2 * size, z + size}};
  o.rest_position = o.position;
  o.mass.assign(4, 0.001);
  o.fixed.assign(4, 0);
  o.contact_triangles = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}};
  return o;
}

Description scene(std::vector<Object> objects) {
  Description d;
  d.objects = std::move(objects);
  return d;
}

Object floorBelow() {
  Object o = body("floor", -1.0, 0.5);
  o.model = ObjectModel::Rigid;
  for (auto& p : o.position) p -= Eigen::Vector3d(0.05, 0.05, 0);
  return o;
}

TEST(Falling, WhatNothingHoldsAndNothingLiesBelowFalls) {
  EXPECT_EQ(fallingObjects(scene({body("ball", 0)})), std::vector<std::size_t>{0});
  EXPECT_EQ(fallingSentence(scene({body("ball", 0)})).rfind("object ball falls for ever", 0), 0u);
  auto beside = floorBelow();
  for (auto& p : beside.position) p.x() += 3.0;
  EXPECT_EQ(fallingObjects(scene({body("ball", 0), beside})), std::vector<std::size_t>{0});
  auto above = floorBelow();
  for (auto& p : above.position) p.z() += 3.0;
  EXPECT_EQ(fallingObjects(scene({body("ball", 0), above})), std::vector<std::size_t>{0});
}

TEST(Falling, AFloorAFixedKnotATetherCarry) {
  EXPECT_TRUE(fallingObjects(scene({body("ball", 0), floorBelow()})).empty());
  Object held = body("ball", 0);
  held.fixed[2] = 1;
  EXPECT_TRUE(fallingObjects(scene({held})).empty());
  Object tethered = body("ball", 0);
  tethered.tethers.push_back({0, {0, 0, 0}, 1.0, 0.0});
  EXPECT_TRUE(fallingObjects(scene({tethered})).empty());
  EXPECT_EQ(fallingSentence(scene({tethered})), "");
}

TEST(Falling, WhatLiesOnOrHangsFromWhatIsCarriedIsCarriedToo) {
  const Description pile = scene({body("upper", 0.02), body("lower", 0), floorBelow()});
  EXPECT_TRUE(fallingObjects(pile).empty());
  Object held = body("held", 1.0);
  held.fixed[0] = 1;
  for (auto& p : held.position) p.x() += 1.0;
  Description chain = scene({body("hanging", 0), held});
  EXPECT_EQ(fallingObjects(chain), std::vector<std::size_t>{0});
  chain.connections.resize(1);
  chain.connections[0].object0 = "hanging", chain.connections[0].object1 = "held";
  EXPECT_TRUE(fallingObjects(chain).empty());
}

TEST(Falling, TwoThatFallTogetherAreBothNamed) {
  const Description d = scene({body("upper", 0.02), body("lower", 0)});
  EXPECT_EQ(fallingSentence(d).rfind("objects upper, lower fall for ever", 0), 0u);
}

TEST(Falling, BelowIsWhereGravityPullsAndWithoutItNothingFalls) {
  Description d = scene({body("ball", 0), floorBelow()});
  d.gravity = {0, 0, 9.81};
  EXPECT_EQ(fallingObjects(d), std::vector<std::size_t>{0});
  d.gravity = {0, 0, 0};
  EXPECT_TRUE(fallingObjects(d).empty());
}

/// Whoever opens a file of a stranger waits a second, and is not told what was not looked at.
TEST(Falling, WhatASecondOfLookingDoesNotTellIsNotSaidToFall) {
  Object upper = body("upper", 1.0), lower = body("lower", 0.0);
  lower.fixed[0] = 1;
  // Slivers along a diagonal: no box tells that a ray misses them.
  lower.position.clear(), lower.contact_triangles.clear();
  for (Index i = 0; i < 60000; ++i) {
    const double z = -1e-6 * i;
    for (const double e : {0.0, 1e-9, 2e-9})
      lower.position.emplace_back(e > 0 ? 1.0 + e : 0.0, e > 0 ? 1.0 : 0.0, z);
    lower.contact_triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
  }
  upper.position.assign(2000, {0.6, 0.4, 1.0});
  const auto sized = [](Object& o) {
    o.rest_position = o.position;
    o.mass.assign(o.position.size(), 0.001), o.fixed.resize(o.position.size(), 0);
  };
  sized(upper), sized(lower);
  EXPECT_TRUE(fallingObjects(scene({upper, lower})).empty());
  upper.position.resize(20), sized(upper);
  EXPECT_EQ(fallingObjects(scene({upper, lower})), std::vector<std::size_t>{0});
}

}  // namespace
