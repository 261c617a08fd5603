#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "vest_viz/inspect/colour_map.h"
#include "vest_viz/inspect/pick.h"

namespace vest::inspect {
namespace {

using Eigen::Vector3d;

/// Two parallel squares of four knots, 5 cm apart, seen along z.
mesh::Store squares() {
  mesh::Topology t;
  t.revision = 1;
  for (int i = 0; i < 2; ++i) {
    mesh::Object o;
    o.name = i == 0 ? "near" : "far";
    o.organ = "tube";
    o.knot_count = 4;
    const float z = i == 0 ? 0.10f : 0.15f;
    o.rest_position = {0, 0, z, 0.02f, 0, z, 0.02f, 0.02f, z, 0, 0.02f, z};
    o.link_knots = {0, 1, 1, 2, 2, 3, 3, 0};
    o.link_alive = {1, 1, 1, 1};
    o.link_kind = {0, 1, 0, 0};
    o.triangles = {0, 1, 2, 0, 2, 3};
    o.binding_start = {0, 1, 2, 3, 4};
    o.binding_knots = {0, 1, 2, 3};
    o.binding_weights = {1, 1, 1, 1};
    t.objects.push_back(o);
  }
  mesh::Store store;
  store.setTopology(t);
  store.rebuildSkins();
  return store;
}

TEST(Pick, TakesTheKnotUnderTheRayAndNotTheOneBehindTheSkin) {
  const mesh::Store store = squares();
  const Picked knot = pick(store, {0.0198, 0.0005, 0}, Vector3d::UnitZ(), 0.02);
  EXPECT_EQ(knot.kind, Picked::Kind::Knot);
  EXPECT_EQ(knot.object, 0u);
  EXPECT_EQ(knot.element, 1u);
  EXPECT_NEAR(knot.distance, 0.10, 1e-6);
  // A ray on a knot of the far square that passes beside the near one by a hair has the skin in front.
  EXPECT_EQ(pick(store, {0.01, 0.008, 0}, Vector3d::UnitZ(), 0.02).kind, Picked::Kind::Nothing);
}

TEST(Pick, TakesALivingLinkWhereThereIsNoKnot) {
  mesh::Store store = squares();
  const Picked link = pick(store, {0.0199, 0.010, 0}, Vector3d::UnitZ(), 0.02);
  ASSERT_EQ(link.kind, Picked::Kind::Link);
  EXPECT_EQ(link.element, 1u);
  const std::vector<std::string> lines = describe(store, link);
  EXPECT_NE(std::find(lines.begin(), lines.end(), "kind: viscous"), lines.end());
  EXPECT_NE(std::find(lines.begin(), lines.end(), "length: 20.000 mm"), lines.end());
  mesh::Delta d;
  d.from_revision = 1, d.revision = 2, d.object = 0;
  d.removed_links = {1};
  ASSERT_EQ(store.applyDelta(d), mesh::Outcome::Accepted);
  store.rebuildSkins();
  EXPECT_EQ(pick(store, {0.0199, 0.010, 0}, Vector3d::UnitZ(), 0.02).kind, Picked::Kind::Nothing);
}

TEST(Pick, DescribesAKnotWithItsFieldsAndNothingThatIsGone) {
  mesh::Store store = squares();
  mesh::Field field;
  field.kind = 1, field.minimum = 300, field.maximum = 400;
  field.data.assign(8, 0);
  field.data[1] = 255;
  store.setField(1, field);
  const std::vector<std::string> lines = describe(store, {Picked::Kind::Knot, 0, 1, 0.1});
  EXPECT_NE(std::find(lines.begin(), lines.end(), "temperature: 400 K"), lines.end());
  EXPECT_NE(std::find(lines.begin(), lines.end(), "links: 2"), lines.end());
  EXPECT_TRUE(describe(store, {Picked::Kind::Knot, 0, 4, 0.1}).empty());
  EXPECT_TRUE(describe(store, {Picked::Kind::Link, 2, 0, 0.1}).empty());
  EXPECT_TRUE(describe(store, {}).empty());
}

TEST(ColourMap, BrightensAllTheWayAndShowsNaNAsGrey) {
  float before = -1;
  for (int i = 0; i <= 40; ++i) {
    const Colour c = valueColour(static_cast<float>(i) / 40);
    const float luminance = 0.299f * c[0] + 0.587f * c[1] + 0.114f * c[2];
    EXPECT_GT(luminance, before) << i;
    before = luminance;
  }
  EXPECT_EQ(valueColour(7), valueColour(1));
  EXPECT_EQ(valueColour(std::nanf("")), (Colour{0.5f, 0.5f, 0.5f}));
  EXPECT_EQ(nameColour("uterus"), nameColour("uterus"));
  EXPECT_NE(nameColour("uterus"), nameColour("tube_left"));
}

TEST(Ticks, AreRoundNumbersInside) {
  EXPECT_EQ(ticks(0, 1, 6), (std::vector<double>{0, 0.2, 0.4, 0.6000000000000001, 0.8, 1}));
  for (double t : ticks(309.7, 374.2, 5)) {
    EXPECT_GE(t, 309.7);
    EXPECT_LE(t, 374.2);
    EXPECT_NEAR(std::fmod(t, 10), 0, 1e-9);
  }
  EXPECT_GE(ticks(309.7, 374.2, 5).size(), 2u);
  EXPECT_TRUE(ticks(1, 1, 5).empty());
  EXPECT_TRUE(ticks(0, std::numeric_limits<double>::quiet_NaN(), 5).empty());
}

TEST(ColourMap, AScaleFitsItselfToTheValuesInRoundSteps) {
  using Ends = std::array<double, 2>;
  const auto near = [](const Ends& is, const Ends& wanted) {
    return std::fabs(is[0] - wanted[0]) < 1e-9 * wanted[1] && std::fabs(is[1] - wanted[1]) < 1e-9 * wanted[1];
  };
  EXPECT_TRUE(near(fittedScale(0.013, 0.187, 1e-3), {0.0, 0.2}));
  EXPECT_TRUE(near(fittedScale(310.1, 316.2, 0.1), {310, 318}));
  EXPECT_TRUE(near(fittedScale(0, 43000, 1), {0, 50000}));
  const Ends still = fittedScale(0.5, 0.5, 0.01);
  EXPECT_GT(still[1] - still[0], 0.009) << "a field that is the same everywhere is no division by zero";
  EXPECT_LE(still[0], 0.5);
  for (double high = 0.11; high < 2.1; high += 0.01) {
    const Ends ends = fittedScale(0.02, high, 1e-3);
    EXPECT_LE(ends[0], 0.02);
    EXPECT_GE(ends[1], high - 1e-9);
    EXPECT_LT(ends[1] - ends[0], 2 * (high - 0.02)) << high << ": half of the colours at least";
  }
}

}  // namespace
}  // namespace vest::inspect
