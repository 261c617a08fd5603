#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include "vest_tissue/modelling/bake.h"
#include "vest_tissue/net/skin.h"
#include "vest_tissue/scene/spread_texture.h"

using namespace vest::modelling;

namespace {

TubeSpec straightTube(End end) {
  TubeSpec spec;
  spec.centre = {{0, 0, 0}, {0.04, 0, 0}, {0.08, 0, 0}};
  spec.reference = {0, 1, 0};
  spec.sections = {{0.0, {0.005}}};
  spec.rings = 20;
  spec.around = 8;
  spec.start = spec.end = end;
  if (end == End::Pole) spec.start_dome = spec.end_dome = 0.005;
  return spec;
}

SheetSpec flatSheet() {
  SheetSpec spec;
  spec.curves = {{{0, 0, 0.03}, {0.05, 0, 0.03}}, {{0, 0, 0}, {0.05, 0, 0}}};
  spec.stations = 8;
  spec.height_knots = 5;
  spec.thickness = 0.003;
  return spec;
}

std::vector<Vector3> vertices(const RingNet& net, const vest::scene::Skin& skin) {
  std::vector<float> knots, out(3 * skin.texture_coordinates.size());
  for (const auto& p : net.knots)
    for (int k = 0; k < 3; ++k) knots.push_back(static_cast<float>(p[k]));
  vest::net::rebuildSkin(knots.data(), skin.binding_start.data(), skin.binding_knots.data(),
                         skin.binding_weights.data(), skin.texture_coordinates.size(), out.data());
  std::vector<Vector3> result;
  for (std::size_t v = 0; v < skin.texture_coordinates.size(); ++v)
    result.emplace_back(out[3 * v], out[3 * v + 1], out[3 * v + 2]);
  return result;
}

// Every edge is used once in each direction: closed, one orientation.
template <class Triangles>
void expectClosed(const Triangles& triangles) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
  for (const auto& t : triangles)
    for (int k = 0; k < 3; ++k) ++edges[{t[k], t[(k + 1) % 3]}];
  for (const auto& [edge, count] : edges) {
    EXPECT_EQ(count, 1) << edge.first << "-" << edge.second;
    EXPECT_EQ(edges.count({edge.second, edge.first}), 1u) << "open at " << edge.first << "-" << edge.second;
  }
}

}  // namespace

TEST(RingNet, KnotSurfacesAreClosedAndFaceOutwards) {
  for (const RingNet& net :
       {makeTube(straightTube(End::Pole)), makeTube(straightTube(End::Cap)), makeSheet(flatSheet())}) {
    const auto triangles = knotTriangles(net);
    expectClosed(triangles);
    EXPECT_GT(enclosedVolume(net.knots, triangles), 0);
  }
}

TEST(RingNet, SkinsAreClosedFaceOutwardsAndEveryKnotMovesThem) {
  for (const RingNet& net :
       {makeTube(straightTube(End::Pole)), makeTube(straightTube(End::Cap)), makeSheet(flatSheet())}) {
    const auto skin = makeSkin(net, 2, 3);
    expectClosed(skin.triangles);
    EXPECT_GT(enclosedVolume(vertices(net, skin), skin.triangles), 0);
    std::set<std::uint32_t> bound(skin.binding_knots.begin(), skin.binding_knots.end());
    EXPECT_EQ(bound.size(), net.knots.size());
    for (std::size_t v = 0; v + 1 < skin.binding_start.size(); ++v) {
      EXPECT_LE(skin.binding_start[v + 1] - skin.binding_start[v], 16u);
      double sum = 0;
      for (auto e = skin.binding_start[v]; e < skin.binding_start[v + 1]; ++e) sum += skin.binding_weights[e];
      EXPECT_NEAR(sum, 1.0, 1e-6);
    }
  }
}

TEST(RingNet, ASkinFollowsATranslationAndATurnOfItsKnots) {
  RingNet net = makeTube(straightTube(End::Pole));
  const auto skin = makeSkin(net, 2, 3);
  const auto before = vertices(net, skin);
  const Eigen::AngleAxisd turn(0.7, Vector3(1, 2, 3).normalized());
  for (auto& knot : net.knots) knot = turn * knot + Vector3(0.01, 0.02, 0.03);
  const auto after = vertices(net, skin);
  for (std::size_t v = 0; v < before.size(); ++v) {
    EXPECT_LT((after[v] - (turn * before[v] + Vector3(0.01, 0.02, 0.03))).norm(), 1e-7);
  }
}

TEST(RingNet, ASkinOfARoundTubeIsRoundWithinFivePercent) {
  const RingNet net = makeTube(straightTube(End::Pole));
  const auto skin = makeSkin(net, 2, 3);
  for (const auto& p : vertices(net, skin)) {
    if (p.x() < 0.01 || p.x() > 0.07) continue;
    EXPECT_NEAR(std::hypot(p.y(), p.z()), 0.005, 0.00025);
  }
}

TEST(RingNet, TextureCoordinatesAreMetresAndKeepAreas) {
  const RingNet net = makeTube(straightTube(End::Pole));
  const auto skin = makeSkin(net, 2, 3);
  const auto points = vertices(net, skin);
  double on_skin = 0, on_texture = 0;
  for (const auto& t : skin.triangles) {
    on_skin += 0.5 * (points[t[1]] - points[t[0]]).cross(points[t[2]] - points[t[0]]).norm();
    const auto uv = [&](int k) {
      return Eigen::Vector2d(skin.texture_coordinates[t[k]][0], skin.texture_coordinates[t[k]][1]);
    };
    const Eigen::Vector2d a = uv(1) - uv(0), b = uv(2) - uv(0);
    on_texture += 0.5 * std::abs(a.x() * b.y() - a.y() * b.x());
  }
  EXPECT_NEAR(on_texture / on_skin, 1.0, 0.05);
}

// A ball of 40 mm that an endoscope sees from its end, where the rings close: the texture of a tube pinches
// there. Spread, each edge within 65 degrees of the middle has its own length.
TEST(RingNet, ASpreadTextureIsEvenWhereItIsLookedAt) {
  TubeSpec spec = straightTube(End::Pole);
  spec.centre = {{0, 0, 0}, {0.02, 0, 0}, {0.04, 0, 0}};
  spec.sections = {{0.0, {0.020}}};
  spec.start_dome = spec.end_dome = 0.0199;
  spec.around = 16;
  const RingNet net = makeTube(spec);
  const Vector3 facing(1, 0, 0.3);
  vest::scene::Skin skin = makeSkin(net, 2, 3);
  const auto points = vertices(net, skin);
  const auto ofLength = [&] {  // least and greatest length on the texture over that on the skin
    std::array<double, 2> range{1e9, 0};
    for (const auto& t : skin.triangles)
      for (int k = 0; k < 3; ++k) {
        const std::uint32_t a = t[k], b = t[(k + 1) % 3];
        const Vector3 from = 0.5 * (points[a] + points[b]) - Vector3(0.02, 0, 0);
        if (from.dot(facing) < std::cos(1.13) * from.norm() * facing.norm()) continue;
        const auto &p = skin.texture_coordinates[a], &q = skin.texture_coordinates[b];
        const double ratio = std::hypot(p[0] - q[0], p[1] - q[1]) / (points[a] - points[b]).norm();
        range = {std::min(range[0], ratio), std::max(range[1], ratio)};
      }
    return range;
  };
  EXPECT_GT(ofLength()[1], 1.9) << "of the tube: else this test shows nothing";
  vest::scene::spreadTexture(net.knots, facing, &skin);
  EXPECT_GT(ofLength()[0], 0.7);
  EXPECT_LT(ofLength()[1], 1.45);
}

TEST(RingNet, LinksAreExactlyAsManyAsAskedForAndNoneTwice) {
  const RingNet net = makeTube(straightTube(End::Pole));
  for (const std::uint32_t springs : {500u, 600u, 640u}) {
    const auto links = makeLinks(net, springs, {LinkClass::Ring2, LinkClass::Strut});
    EXPECT_EQ(links.size(), springs);
    std::set<std::pair<std::uint32_t, std::uint32_t>> known;
    for (const auto& link : links) EXPECT_TRUE(known.insert(std::minmax(link.a, link.b)).second);
  }
  try {
    makeLinks(net, 100, {LinkClass::Ring2});
    FAIL() << "100 springs cannot make this net";
  } catch (const std::invalid_argument& error) {
    EXPECT_NE(std::string(error.what()).find("springs is 100, possible"), std::string::npos) << error.what();
  }
}

TEST(NearestPoint, IsSignedAndFindsFacesEdgesAndCorners) {
  const RingNet net = makeTube(straightTube(End::Cap));
  const auto triangles = knotTriangles(net);
  EXPECT_LT(nearestPoint(net.knots, triangles, {0.04, 0, 0}).distance, -0.004);
  const auto above = nearestPoint(net.knots, triangles, {0.04, 0.009, 0});
  EXPECT_NEAR(above.distance, 0.004, 1e-4);
  EXPECT_GT(above.normal.y(), 0.9);
  EXPECT_GT(nearestPoint(net.knots, triangles, {-0.002, 0.0052, 0}).distance, 0)
      << "beyond a corner is outside";
  const auto weights = above.weights;
  EXPECT_NEAR(weights[0] + weights[1] + weights[2], 1.0, 1e-12);
}

TEST(NearestPoint, IsTheFirstOfThoseThatALookAtEachTriangleFindsNearest) {
  const RingNet net = makeTube(straightTube(End::Cap));
  const auto triangles = knotTriangles(net);
  const NearestPoints nearest(net.knots, triangles);
  std::vector<vest::modelling::Vector3> places(net.knots);  // several triangles are equally near
  for (int i = 0; i < 400; ++i)
    places.emplace_back(0.01 * (i % 9) - 0.02, 0.002 * (i % 11) - 0.011, 0.003 * (i % 7) - 0.009);
  for (const auto& place : places) {
    // Each alone is asked, and the nearest taken; the first where several are equal.
    std::size_t best = 0;
    double least = 1e9;
    for (std::size_t t = 0; t < triangles.size(); ++t) {
      const std::vector<std::array<std::uint32_t, 3>> alone{triangles[t]};
      const auto at = nearestPoint(net.knots, alone, place);
      if ((place - at.point).squaredNorm() < least) least = (place - at.point).squaredNorm(), best = t;
    }
    const auto found = nearest(place);
    ASSERT_EQ(found.triangle, best) << place.transpose();
    ASSERT_EQ((place - found.point).squaredNorm(), least);
  }
}
