#include <cmath>
#include <functional>
#include <limits>

#include <gtest/gtest.h>

#include "sample.h"

namespace vest::mesh {
namespace {

TEST(Store, EmptyStoreDropsStatesAndDeltas) {
  Store store;
  const float p[3] = {0, 0, 0};
  EXPECT_EQ(store.setState(0, p, 3), Outcome::UnknownRevision);
  EXPECT_EQ(store.applyDelta({}), Outcome::UnknownRevision);
  store.rebuildSkins();
  EXPECT_TRUE(store.empty());
}

TEST(Store, EmptyTopologyEmptiesTheStore) {
  Store store;
  store.setTopology(twoSquares());
  EXPECT_EQ(store.setTopology({}), Outcome::Accepted);
  EXPECT_TRUE(store.empty());
}

TEST(Store, WhatNobodyCanSeeMovesNoSkinButAddsUp) {
  Store store;
  ASSERT_EQ(store.setTopology(twoSquares()), Outcome::Accepted);
  store.rebuildSkins();
  std::vector<float> p = positionsOf(store.topology());
  int moved = 0;
  for (int step = 1; step <= 100; ++step) {
    p[3 * 6 + 2] = 2e-6f * static_cast<float>(step);
    ASSERT_EQ(store.setState(5, p.data(), p.size()), Outcome::Accepted);
    store.rebuildSkins();
    moved += store.moved(1);
    ASSERT_NEAR(store.skin(1).positions[3 * 2 + 2], p[3 * 6 + 2], 1.1e-5f) << "step " << step;
    EXPECT_FALSE(store.moved(0));
  }
  EXPECT_LT(moved, 20);
  EXPECT_GT(moved, 10);
}

TEST(Store, SkinFollowsKnotsOfTheState) {
  Store store;
  ASSERT_EQ(store.setTopology(twoSquares()), Outcome::Accepted);
  std::vector<float> p = positionsOf(store.topology());
  p[3 * 6 + 2] = 0.5f;  // second object, knot 2
  ASSERT_EQ(store.setState(5, p.data(), p.size()), Outcome::Accepted);
  store.rebuildSkins();
  EXPECT_FLOAT_EQ(store.skin(1).positions[3 * 2 + 2], 0.5f);
  EXPECT_FLOAT_EQ(store.skin(0).positions[3 * 2 + 2], 0.0f);
  EXPECT_TRUE(store.moved(1));
}

TEST(Store, OnlyObjectsThatMovedAreRebuilt) {
  Store store;
  store.setTopology(twoSquares());
  store.rebuildSkins();
  std::vector<float> p = positionsOf(store.topology());
  p[0] = -1;
  store.setState(5, p.data(), p.size());
  store.rebuildSkins();
  EXPECT_TRUE(store.moved(0));
  EXPECT_FALSE(store.moved(1));
}

TEST(Store, StateOfAnotherRevisionIsDropped) {
  Store store;
  store.setTopology(twoSquares());
  std::vector<float> p = positionsOf(store.topology());
  p[0] = 7;
  EXPECT_EQ(store.setState(6, p.data(), p.size()), Outcome::UnknownRevision);
  EXPECT_FLOAT_EQ(store.knots(0)[0], 0.0f);
  EXPECT_NE(store.problem().find("revision 6"), std::string::npos);
}

TEST(Store, StateOfWrongSizeIsDropped) {
  Store store;
  store.setTopology(twoSquares());
  const std::vector<float> p(23, 0.0f);
  EXPECT_EQ(store.setState(5, p.data(), p.size()), Outcome::Malformed);
}

TEST(Store, NotFinitePositionsKeepTheLastShapeOfThatObjectAlone) {
  for (float bad : {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
    Store store;
    store.setTopology(twoSquares());
    std::vector<float> p = positionsOf(store.topology());
    p[4] = bad;
    p[3 * 4] = -0.25f;  // second object is good
    EXPECT_EQ(store.setState(5, p.data(), p.size()), Outcome::NotFinite);
    store.rebuildSkins();
    for (float x : store.skin(0).positions) EXPECT_TRUE(std::isfinite(x));
    EXPECT_FLOAT_EQ(store.knots(1)[0], -0.25f);
    EXPECT_NE(store.problem().find("first"), std::string::npos);
  }
}

TEST(Store, RepeatedTopologyDoesNotRebuild) {
  Store store;
  store.setTopology(twoSquares());
  const std::uint64_t version = store.shapeVersion();
  EXPECT_EQ(store.setTopology(twoSquares()), Outcome::Repeated);
  EXPECT_EQ(store.shapeVersion(), version);
}

TEST(Store, MalformedObjectsAreEmptiedAndNamedWhileOthersStay) {
  const std::vector<std::function<void(Object*)>> faults = {
      [](Object* o) { o->triangles[0] = 99; },
      [](Object* o) { o->triangles.pop_back(); },
      [](Object* o) { o->binding_knots[0] = 4; },
      [](Object* o) { o->binding_start[2] = 9; },
      [](Object* o) { o->binding_weights.pop_back(); },
      [](Object* o) { o->binding_weights[0] = std::numeric_limits<float>::quiet_NaN(); },
      [](Object* o) { o->rest_position.pop_back(); },
      [](Object* o) { o->rest_position[1] = std::numeric_limits<float>::infinity(); },
      [](Object* o) { o->knot_count = 4000000000u; },
      [](Object* o) { o->texture_coordinates.pop_back(); },
      [](Object* o) { o->link_knots[0] = 4; },
      [](Object* o) { o->link_alive.push_back(1); },
      [](Object* o) { o->triangle_layer.push_back(1); }};
  for (std::size_t i = 0; i < faults.size(); ++i) {
    SCOPED_TRACE(i);
    Topology t = twoSquares();
    faults[i](&t.objects[0]);
    Store store;
    EXPECT_EQ(store.setTopology(t), Outcome::Malformed);
    store.rebuildSkins();
    EXPECT_NE(store.problem().find("object first"), std::string::npos) << store.problem();
    EXPECT_TRUE(store.topology().objects[0].triangles.empty());
    EXPECT_EQ(store.skin(1).positions.size(), 12u);
  }
}

Delta cutOfFirst() {
  // Knot 2 is doubled; the second triangle hangs on the copy through a new skin vertex.
  Delta d;
  d.from_revision = 5;
  d.revision = 6;
  d.object = 0;
  d.doubled_knots = {2};
  d.removed_links = {1};
  d.added_link_knots = {1, 4};
  d.removed_triangles = {1};
  d.added_triangles = {0, 4, 3};
  d.added_triangle_layer = {2};
  d.added_texture_coordinates = {2, 2};
  d.added_binding_start = {0, 1};
  d.added_binding_knots = {4};
  d.added_binding_weights = {1};
  return d;
}

TEST(Store, DeltaDoublesKnotsWhereTheyAreNow) {
  Store store;
  store.setTopology(twoSquares());
  std::vector<float> p = positionsOf(store.topology());
  p[3 * 2 + 2] = 0.3f;
  p[3 * 4] = 0.7f;
  store.setState(5, p.data(), p.size());
  ASSERT_EQ(store.applyDelta(cutOfFirst()), Outcome::Accepted) << store.problem();
  store.rebuildSkins();
  const Object& o = store.topology().objects[0];
  EXPECT_EQ(store.topology().revision, 6u);
  EXPECT_EQ(o.knot_count, 5u);
  EXPECT_EQ(o.link_alive, (std::vector<std::uint8_t>{1, 0, 1}));
  // Indices never shift: the dead triangle stays, without area.
  EXPECT_EQ(o.triangles, (std::vector<std::uint32_t>{0, 1, 2, 0, 0, 0, 0, 4, 3}));
  EXPECT_EQ(o.triangle_layer, (std::vector<std::uint16_t>{0, 0, kCutFace}));
  EXPECT_FLOAT_EQ(store.knots(0)[3 * 4 + 2], 0.3f);
  EXPECT_FLOAT_EQ(store.knots(1)[0], 0.7f);  // the neighbour did not shift
  const std::vector<float> next(3 * 9, 0.1f);
  EXPECT_EQ(store.setState(6, next.data(), next.size()), Outcome::Accepted);
}

TEST(Store, CutFaceHasVerticesOfItsOwnSoThatItsEdgeIsSharp) {
  Store store;
  store.setTopology(twoSquares());
  ASSERT_EQ(store.applyDelta(cutOfFirst()), Outcome::Accepted);
  store.rebuildSkins();
  const Skin& skin = store.skin(0);
  // Vertex 0 belongs to the skin and to the cut face; 3 and 4 to the cut face alone.
  ASSERT_EQ(skin.doubled, (std::vector<std::uint32_t>{0}));
  EXPECT_EQ(skin.triangles[6], 5u);
  EXPECT_EQ(skin.triangles[7], 4u);
  for (int k = 0; k < 3; ++k) EXPECT_EQ(skin.positions[15 + k], skin.positions[k]);
  EXPECT_EQ(skin.uv.size(), 12u);
}

TEST(Store, FieldsReachVerticesThroughTheBindingAndSurviveACut) {
  Store store;
  store.setTopology(twoSquares());
  Field f;
  f.kind = 2, f.minimum = 0, f.maximum = 2;
  f.data = {0, 255, 255, 0, 0, 0, 0, 51};
  EXPECT_EQ(store.setField(4, f), Outcome::UnknownRevision);
  ASSERT_EQ(store.setField(5, f), Outcome::Accepted) << store.problem();
  EXPECT_FLOAT_EQ(store.knotField(0, 2, 1), 2.0f);
  EXPECT_FLOAT_EQ(store.knotField(1, 2, 3), 0.4f);
  EXPECT_TRUE(std::isnan(store.knotField(0, 3, 1)));
  std::vector<std::uint8_t> out(16, 9);
  EXPECT_FLOAT_EQ(store.vertexField(0, 2, 0.0f, 4.0f, out.data(), 2), 128 / 255.0f);
  EXPECT_EQ(out[2], 128);
  EXPECT_EQ(out[3], 9) << "only every second byte is this field's";
  ASSERT_EQ(store.applyDelta(cutOfFirst()), Outcome::Accepted);
  EXPECT_FLOAT_EQ(store.knotField(0, 2, 4), 2.0f) << "the copy has its original's value";
  EXPECT_FLOAT_EQ(store.knotField(1, 2, 3), 0.4f) << "the neighbour did not shift";
  f.data.pop_back();
  EXPECT_EQ(store.setField(6, f), Outcome::Malformed);
}

TEST(Store, DeltaReboundVerticesHangOnOtherKnots) {
  Store store;
  store.setTopology(twoSquares());
  Delta d;
  d.from_revision = 5, d.revision = 6, d.object = 1;
  d.rebound_vertices = {3};
  d.rebound_start = {0, 2};
  d.rebound_knots = {0, 1};
  d.rebound_weights = {0.5f, 0.5f};
  ASSERT_EQ(store.applyDelta(d), Outcome::Accepted) << store.problem();
  store.rebuildSkins();
  EXPECT_FLOAT_EQ(store.skin(1).positions[9], 0.5f);
  EXPECT_FLOAT_EQ(store.skin(1).positions[3], 1.0f);
}

TEST(Store, DeltasThatDoNotFitLeaveEverythingAsItWas) {
  const std::vector<std::function<void(Delta*)>> faults = {
      [](Delta* d) { d->from_revision = 4; },          [](Delta* d) { d->object = 2; },
      [](Delta* d) { d->doubled_knots = {4}; },        [](Delta* d) { d->removed_triangles = {2}; },
      [](Delta* d) { d->removed_triangles = {1, 0}; }, [](Delta* d) { d->added_triangles = {0, 1, 9}; },
      [](Delta* d) { d->removed_links = {2}; },        [](Delta* d) { d->added_binding_start = {1, 1}; },
      [](Delta* d) { d->added_binding_knots = {5}; },  [](Delta* d) { d->added_texture_coordinates.clear(); },
      [](Delta* d) { d->rebound_vertices = {0}; },     [](Delta* d) { d->added_link_knots = {7, 0}; }};
  for (std::size_t i = 0; i < faults.size(); ++i) {
    SCOPED_TRACE(i);
    Store store;
    store.setTopology(twoSquares());
    const std::uint64_t version = store.shapeVersion();
    Delta d = cutOfFirst();
    faults[i](&d);
    EXPECT_NE(store.applyDelta(d), Outcome::Accepted);
    EXPECT_FALSE(store.problem().empty());
    EXPECT_EQ(store.topology().revision, 5u);
    EXPECT_EQ(store.shapeVersion(), version);
    EXPECT_EQ(store.topology().objects[0].knot_count, 4u);
  }
}

TEST(Skin, TangentsPointAlongU) {
  Store store;
  store.setTopology(twoSquares());
  store.rebuildSkins();
  for (std::size_t v = 0; v < 4; ++v) {
    EXPECT_NEAR(store.skin(0).tangents[3 * v], 1.0f, 1e-6);
    EXPECT_NEAR(store.skin(0).normals[3 * v + 2], 1.0f, 1e-6);
  }
}

TEST(Skin, TextureUnitIsMeasuredInMetres) {
  // 2 units of u span 1 m.
  const Object o = square("a");
  EXPECT_NEAR(metresPerTextureUnit(o, o.rest_position.data()), 0.5, 1e-6);
}

}  // namespace
}  // namespace vest::mesh
