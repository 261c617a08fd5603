// Protects the section that a plane makes: its area, its field, its lumina, and that torn or empty things do
// not draw nonsense.
#include <algorithm>
#include <array>
#include <cmath>

#include <gtest/gtest.h>

#include "vest_viz/inspect/slice.h"

namespace vest::inspect {
namespace {

using Eigen::Vector3f;

Vector3f vertex(const Slice& s, std::size_t v) {
  return {s.positions[3 * v], s.positions[3 * v + 1], s.positions[3 * v + 2]};
}

float area(const Slice& s) {
  float sum = 0;
  for (std::size_t t = 0; t + 2 < s.triangles.size(); t += 3) {
    const Vector3f a = vertex(s, s.triangles[t]);
    sum += 0.5f * (vertex(s, s.triangles[t + 1]) - a).cross(vertex(s, s.triangles[t + 2]) - a).norm();
  }
  return sum;
}

/// A cuboid about the origin, closed skin, one knot per corner. @param outwards false: its inner wall
void addBox(mesh::Object* o, const Vector3f& edge, bool outwards) {
  const std::uint32_t first = o->knot_count;
  for (int i = 0; i < 8; ++i) {
    for (int k = 0; k < 3; ++k) o->rest_position.push_back(edge[k] * ((i >> k & 1) - 0.5f));
    if (o->binding_start.empty()) o->binding_start.push_back(0);
    o->binding_knots.push_back(o->knot_count++);
    o->binding_weights.push_back(1);
    o->binding_start.push_back(o->knot_count);
  }
  constexpr std::array<std::uint32_t, 36> kFaces{0, 2, 1, 1, 2, 3, 4, 5, 6, 5, 7, 6, 0, 1, 4, 1, 5, 4,
                                                 2, 6, 3, 3, 6, 7, 0, 4, 2, 2, 4, 6, 1, 3, 5, 3, 7, 5};
  for (std::size_t t = 0; t < kFaces.size(); t += 3) {
    o->triangles.push_back(first + kFaces[t]);
    o->triangles.push_back(first + kFaces[t + (outwards ? 1 : 2)]);
    o->triangles.push_back(first + kFaces[t + (outwards ? 2 : 1)]);
    o->triangle_layer.push_back(outwards ? mesh::kOuterSkin : mesh::kInnerWall);
  }
}

mesh::Store storeOf(const mesh::Object& object) {
  mesh::Topology t;
  t.revision = 1;
  t.objects = {object};
  mesh::Store store;
  EXPECT_EQ(store.setTopology(t), mesh::Outcome::Accepted) << store.problem();
  store.rebuildSkins();
  return store;
}

/// The cuboid in six tetrahedra round its diagonal (Kuhn).
mesh::Object block(const Vector3f& edge) {
  mesh::Object o;
  o.name = "block";
  addBox(&o, edge, true);
  for (const auto& path : {std::array<int, 2>{1, 3}, {1, 5}, {2, 3}, {2, 6}, {4, 5}, {4, 6}})
    o.tetrahedra.insert(o.tetrahedra.end(), {0u, std::uint32_t(path[0]), std::uint32_t(path[1]), 7u});
  return o;
}

/// Field of kind 1 that grows with x from 0 to 255.
void addField(mesh::Store* store, float width) {
  mesh::Field f;
  f.kind = 1, f.minimum = 0, f.maximum = 10;
  const mesh::Object& o = store->topology().objects[0];
  for (std::uint32_t k = 0; k < o.knot_count; ++k)
    f.data.push_back(static_cast<std::uint8_t>(255 * (o.rest_position[3 * k] / width + 0.5f) + 0.5f));
  ASSERT_EQ(store->setField(1, f), mesh::Outcome::Accepted);
}

TEST(Slice, OfAVolumeHasTheAreaOfItsSectionAndTheFieldInside) {
  mesh::Store store = storeOf(block({0.06f, 0.04f, 0.02f}));
  addField(&store, 0.06f);
  const SliceField field{1, 0, 10};
  const Slice s = slice(store, {Vector3f::UnitZ(), 0.004f}, {}, &field);
  EXPECT_NEAR(area(s), 0.06f * 0.04f, 1e-6f);
  for (std::size_t v = 0; v < s.values.size(); ++v) {
    EXPECT_NEAR(vertex(s, v).z(), 0.004f, 1e-6f);
    EXPECT_NEAR(s.values[v], vertex(s, v).x() / 0.06f + 0.5f, 0.005f) << "in between the surfaces too";
  }
  const Vector3f slant = Vector3f(1, 2, 3).normalized();
  const Slice oblique = slice(store, {slant, 0.0f}, {}, &field);
  for (std::size_t v = 0; v < oblique.values.size(); ++v)
    EXPECT_NEAR(slant.dot(vertex(oblique, v)), 0, 1e-6f);
  EXPECT_GT(area(oblique), 0.06f * 0.02f);
  EXPECT_TRUE(slice(store, {Vector3f::UnitZ(), 0.5f}, {}, &field).triangles.empty());
  EXPECT_TRUE(slice(
                  store, {Vector3f::UnitZ(), 0}, [](std::size_t) { return false; }, &field)
                  .borders.empty());
}

TEST(Slice, TellsTheMaterialInsideByItsTetrahedron) {
  mesh::Object o = block({0.06f, 0.04f, 0.02f});
  o.tetrahedron_material = {0, 0, 1, 1, 2, 2};
  const Slice s = slice(storeOf(o), {Vector3f::UnitZ(), 0.0f}, {}, nullptr);
  for (const int material : {0, 1, 2})
    EXPECT_NE(std::find(s.material.begin(), s.material.end(), material), s.material.end()) << material;
  EXPECT_EQ(std::find(s.material.begin(), s.material.end(), -1), s.material.end());
  o.tetrahedron_material.pop_back();
  EXPECT_NE(mesh::validate(o).find("tetrahedron_material"), std::string::npos);
}

TEST(Slice, OfAHollowNetShowsItsWallAndLeavesTheLumenEmpty) {
  mesh::Object o;
  o.name = "hollow";
  addBox(&o, {0.06f, 0.04f, 0.04f}, true);
  addBox(&o, {0.05f, 0.02f, 0.02f}, false);
  const Slice s = slice(storeOf(o), {Vector3f::UnitX(), 0.01f}, {}, nullptr);
  const float wall = 0.04f * 0.04f - 0.02f * 0.02f;
  EXPECT_NEAR(area(s), wall, 0.02f * wall) << "rows of 0.4 mm";
  for (std::size_t t = 0; t + 2 < s.triangles.size(); t += 3) {
    const Vector3f middle =
        (vertex(s, s.triangles[t]) + vertex(s, s.triangles[t + 1]) + vertex(s, s.triangles[t + 2])) / 3;
    EXPECT_GT(std::max(std::fabs(middle.y()), std::fabs(middle.z())), 0.0095f) << "in the lumen";
  }
  EXPECT_TRUE(std::isnan(s.values.front())) << "no field was asked for";
  o.rigid = true;
  const Slice rigid = slice(storeOf(o), {Vector3f::UnitX(), 0.01f}, {}, nullptr);
  EXPECT_TRUE(rigid.triangles.empty());
  EXPECT_EQ(rigid.borders.size(), s.borders.size());
}

TEST(Slice, LeavesOutElementsThatACutHasTornOpen) {
  mesh::Store store = storeOf(block({0.02f, 0.02f, 0.02f}));
  std::vector<float> moved(store.knots(0), store.knots(0) + 24);
  for (std::size_t k = 0; k < 8; ++k)
    if (moved[3 * k] > 0) moved[3 * k] += 0.2f;
  ASSERT_EQ(store.setState(1, moved.data(), moved.size()), mesh::Outcome::Accepted);
  store.rebuildSkins();
  EXPECT_TRUE(slice(store, {Vector3f::UnitX(), 0.1f}, {}, nullptr).triangles.empty());
}

TEST(Slice, TetrahedraThatNameNoKnotAreRefused) {
  mesh::Object o = block({0.02f, 0.02f, 0.02f});
  o.tetrahedra.back() = 8;
  mesh::Topology t;
  t.revision = 1;
  t.objects = {o};
  mesh::Store store;
  EXPECT_EQ(store.setTopology(t), mesh::Outcome::Malformed);
  EXPECT_NE(store.problem().find("tetrahedra"), std::string::npos);
  EXPECT_TRUE(slice(store, {Vector3f::UnitX(), 0.0f}, {}, nullptr).triangles.empty());
}

}  // namespace
}  // namespace vest::inspect
