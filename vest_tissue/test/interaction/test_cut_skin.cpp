#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <string>
#include <vector>

#include "blades.h"
#include "vest_tissue/scene/world_model.h"

namespace {

using namespace vest;
using Eigen::Vector3d;

/// A scene of the package whose organ lies along kAxis, cut across by scissors.
const Vector3d kAxis(0.52, 0.8542, 0), kMiddle(0, 0.05, 0.056);

struct Tube {
  scene::World world;
  scene::StepInput input;
  scene::StepReport report;
  std::vector<scene::Topology> reader;
  bool separated = false;
  std::size_t largest = 0;  ///< triangles of a delta

  explicit Tube(const std::string& name, double stiffness = 1.0) : world(sceneOf(name, stiffness)) {
    reader.push_back(world.topology(0));
  }
  /// The scene with its organ so many times as stiff.
  static scene::Description sceneOf(const std::string& name, double stiffness) {
    const std::string folder = std::string(VEST_TISSUE_SOURCE_DIR) + "/scenes/" + name + "/";
    scene::Description d = scene::loadScene(folder + name + ".yaml");
    d.objects[0].law.youngs_modulus *= stiffness;
    return d;
  }
  void step() {
    const std::uint32_t before = world.revision();
    input.step = world.steps();
    ASSERT_NE(world.step(input, report), scene::Status::Fault);
    for (const auto& e : report.events) separated = separated || e.kind == scene::EventKind::Separated;
    std::vector<scene::TopologyDelta> deltas;
    ASSERT_TRUE(world.deltasSince(before, deltas));
    for (const auto& d : deltas) {
      ASSERT_TRUE(std::is_sorted(d.removed_triangles.begin(), d.removed_triangles.end()));
      ASSERT_TRUE(scene::applyDelta(reader[0], d));
      largest = std::max(largest, d.added_triangles.size());
    }
  }
  /// The shaft turned by an angle in the plane of the axis.
  void cut(double jaw_end, double turn = 0.0) {
    Vector3d centre = Vector3d::Zero();
    std::vector<float> p(3 * world.knotCount(0));
    world.positions(0, p.data());
    int n = 0;
    for (std::size_t i = 0; i < world.knotCount(0); ++i)
      if (std::fabs(kAxis.dot(Vector3d(p[3 * i], p[3 * i + 1], p[3 * i + 2]) - kMiddle)) < 0.004)
        centre += Vector3d(p[3 * i], p[3 * i + 1], p[3 * i + 2]), ++n;
    centre /= n;
    centre -= kAxis * kAxis.dot(centre - kMiddle);
    const Vector3d across(-kAxis.y(), kAxis.x(), 0);
    const Vector3d along = Eigen::AngleAxisd(turn, Vector3d::UnitZ()) * across, tip = centre + 0.0065 * along;
    for (int i = 0; i < 80; ++i) {
      input.tools[1] = specimen::toolAt(tools::ToolKind::Scissors, tip - 0.02 * (1 - i / 80.0) * along, along,
                                        Vector3d(0, 0, 1), 0.75);
      step();
    }
    for (int i = 0; i <= 200; ++i) {
      input.tools[1] = specimen::toolAt(tools::ToolKind::Scissors, tip, along, Vector3d(0, 0, 1),
                                        0.75 + (jaw_end - 0.75) * i / 200.0);
      step();
    }
  }
};

/// No skin triangle spans the gap: every one hangs on the knots of one piece.
void expectNoSkinAcross(const Tube& t, std::size_t pieces) {
  const scene::Topology& now = t.world.topology(0);
  std::vector<std::uint32_t> part;
  ASSERT_EQ(specimen::pieces(t.world, 0, part), pieces);
  for (std::size_t i = 0; i < now.skin.triangles.size(); ++i) {
    if (!now.triangle_alive[i]) continue;
    for (const std::uint32_t v : now.skin.triangles[i]) {
      for (std::uint32_t e = now.skin.binding_start[v]; e < now.skin.binding_start[v + 1]; ++e) {
        const std::uint32_t first = now.skin.binding_knots[now.skin.binding_start[now.skin.triangles[i][0]]];
        ASSERT_EQ(part[now.skin.binding_knots[e]], part[first])
            << "triangle " << i << " layer " << now.skin.layer[i];
      }
    }
  }
}

/// Edges of the surface from a triangle to the furthest of some knots.
int edgesTo(const Tube& t, std::uint32_t triangle, const std::uint32_t* begin, const std::uint32_t* end) {
  const auto& triangles = t.world.contactTriangles(0);
  std::set<std::uint32_t> reached(triangles[triangle].begin(), triangles[triangle].end());
  int edges = 0;
  while (!std::all_of(begin, end, [&](std::uint32_t knot) { return reached.count(knot) > 0; })) {
    const std::set<std::uint32_t> before = reached;
    for (const auto& k : triangles)
      if (before.count(k[0]) + before.count(k[1]) + before.count(k[2]) > 0)
        reached.insert(k.begin(), k.end());
    if (reached.size() == before.size()) return 1000;
    ++edges;
  }
  return edges;
}

TEST(CutSkin, ATubeOpensIntoTwoStumpsWithFaceAndInnerWall) {
  Tube t("cut_tube");
  for (int i = 0; i < 200; ++i) t.step();
  t.cut(0.0);
  for (int i = 0; i < 40; ++i) t.step();
  EXPECT_TRUE(t.separated);
  const scene::Topology& now = t.world.topology(0);
  const scene::Object& o = t.world.description().objects[0];
  std::array<std::size_t, 3> layers{};
  for (std::size_t i = 0; i < now.skin.triangles.size(); ++i)
    if (now.triangle_alive[i]) ++layers[now.skin.layer[i]];
  EXPECT_EQ(layers[0], o.skin.triangles.size()) << "the outside is opened, nothing of it is lost";
  EXPECT_GT(layers[1], 200u) << "inner wall";
  EXPECT_GT(layers[2], 80u) << "the wall's thickness, on both stumps";
  EXPECT_EQ(t.world.state().objects[0].elements.volumes[0].bulk_modulus, 0.0f)
      << "an open tube holds no pressure";
  expectNoSkinAcross(t, 2);
  // At rest the lips lie on the blade's plane, and weights are those of places: they sum to 1.
  for (std::size_t v = 0; v + 1 < now.skin.binding_start.size(); ++v) {
    double sum = 0.0;
    for (std::uint32_t e = now.skin.binding_start[v]; e < now.skin.binding_start[v + 1]; ++e)
      sum += now.skin.binding_weights[e];
    ASSERT_NEAR(sum, 1.0, 1e-4) << "vertex " << v;
  }
  std::size_t on_plane = 0;
  const auto& cut = t.world.state().objects[0].cut;
  for (std::size_t v = 0; v < cut.outer.size(); ++v)
    if (cut.outer[v] != interaction::kNone &&
        std::fabs(kAxis.dot(Vector3d(cut.rest[v][0], cut.rest[v][1], cut.rest[v][2]) - kMiddle)) < 0.0008)
      ++on_plane;
  EXPECT_GT(on_plane, 40u);
}

// The line of the cut leaves its ring. Knots of the next ring that lie behind it are not doubled, and skin of
// this side hung on them.
TEST(CutSkin, NoSkinSpansTheGapWhereverTheLineRuns) {
  for (const double stiffness : {1.0, 1.06}) {
    for (const double turn : {-0.5, 0.0, 0.5}) {
      SCOPED_TRACE(testing::Message() << "stiffness " << stiffness << " turned " << turn);
      Tube t("cut_tube", stiffness);
      for (int i = 0; i < 200; ++i) t.step();
      t.cut(0.0, turn);
      for (int i = 0; i < 40; ++i) t.step();
      expectNoSkinAcross(t, 2);
    }
  }
}

TEST(CutSkin, BesideACutThatEndsInTheOrganSkinHangsOnItsOwnSide) {
  for (const double turn : {-0.5, 0.5}) {
    SCOPED_TRACE(testing::Message() << "turned " << turn);
    Tube t("cut_strip");
    for (int i = 0; i < 200; ++i) t.step();
    t.cut(0.25, turn);
    const auto& cut = t.world.state().objects[0].cut;
    ASSERT_FALSE(t.separated);
    ASSERT_GT(cut.tracks.size(), 8u);
    const scene::Skin& skin = t.world.topology(0).skin;
    for (std::size_t v = 0; v < cut.free.size(); ++v) {
      if (cut.free[v] != 0) continue;  // on the lips
      const std::uint32_t* const knots = skin.binding_knots.data();
      EXPECT_LE(edgesTo(t, cut.lies_on[v], knots + skin.binding_start[v], knots + skin.binding_start[v + 1]),
                3)
          << "vertex " << v;
    }
  }
}

TEST(CutSkin, AReaderOfTheDeltasHasTheSameTopologyAtEveryStep) {
  Tube t("cut_tube");
  for (int i = 0; i < 100; ++i) t.step();
  t.cut(0.1);
  const scene::Topology &a = t.reader[0], &b = t.world.topology(0);
  ASSERT_GT(b.revision, 3u);
  EXPECT_EQ(a.revision, b.revision);
  EXPECT_EQ(a.link_alive, b.link_alive);
  EXPECT_EQ(a.doubled_knots, b.doubled_knots);
  EXPECT_EQ(a.skin.binding_start, b.skin.binding_start);
  EXPECT_EQ(a.skin.binding_knots, b.skin.binding_knots);
  EXPECT_EQ(a.skin.binding_weights, b.skin.binding_weights);
  EXPECT_EQ(a.skin.texture_coordinates, b.skin.texture_coordinates);
  EXPECT_EQ(a.skin.triangles, b.skin.triangles);
  EXPECT_EQ(a.skin.layer, b.skin.layer);
  EXPECT_EQ(a.triangle_alive, b.triangle_alive);
  EXPECT_LE(t.largest, 512u);
}

TEST(CutSkin, ASolidStripKeepsItsVolumeInBothParts) {
  Tube t("cut_strip");
  for (int i = 0; i < 200; ++i) t.step();
  t.cut(0.0);
  const auto& s = t.world.state().objects[0];
  ASSERT_GE(s.cut.parts, 1u);
  double rest = 0.0;
  for (const auto& v : s.elements.volumes)
    if (v.bulk_modulus > 0.0f) rest += v.rest;
  const double before = t.world.model().start.objects[0].elements.volumes[0].rest;
  EXPECT_NEAR(rest, before, 0.03 * before) << "no tissue is lost at the cut";
  // The strip is 16 x 6 mm. The wound's faces meet in the middle of its thickness, those of the narrow sides
  // too: flat ones of 8 mm would stick out of the bent halves as shards.
  const scene::Topology& now = t.world.topology(0);
  for (std::size_t i = 0; i < now.skin.triangles.size(); ++i) {
    if (!now.triangle_alive[i] || now.skin.layer[i] != 2) continue;
    for (std::size_t k = 0; k < 3; ++k) {
      const auto &a = s.cut.rest[now.skin.triangles[i][k]],
                 &b = s.cut.rest[now.skin.triangles[i][(k + 1) % 3]];
      ASSERT_LT(std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]), 0.0055f) << "face " << i;
    }
  }
  for (int i = 0; i < 400; ++i) t.step();
  const net::ElementArrays a{s.block.row(net::Block::X),
                             s.block.row(net::Block::Y),
                             s.block.row(net::Block::Z),
                             nullptr,
                             nullptr,
                             nullptr,
                             nullptr,
                             nullptr,
                             nullptr};
  for (const auto& v : s.elements.volumes) {
    if (v.bulk_modulus > 0.0f) {
      EXPECT_NEAR(net::enclosedVolume(v, a), v.rest, 0.1 * v.rest);
    }
  }
}

}  // namespace
