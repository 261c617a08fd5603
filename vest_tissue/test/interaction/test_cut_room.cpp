#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <vector>

#include "blades.h"
#include "theatre.h"
#include "vest_tissue/scene/world_model.h"

namespace {

using namespace vest;
using Eigen::Vector3d;
using scene::Index;

/// A skin of n² triangles for each of the surface, whose vertices hang on their corners and the knots around.
void coverFinely(scene::Object& o, int n) {
  std::vector<std::set<Index>> around(o.position.size());
  for (const auto& t : o.contact_triangles)
    for (const Index a : t) around[a].insert(t.begin(), t.end());
  scene::Skin& skin = o.skin = scene::Skin{};
  skin.binding_start.push_back(0);
  std::map<std::map<Index, int>, std::uint32_t> known;  // n times the weights of its triangle's corners
  const auto vertex = [&](const std::array<Index, 3>& t, int a, int b) {
    std::map<Index, int> place;
    const std::array<int, 3> parts{n - a - b, a, b};
    for (std::size_t i = 0; i < 3; ++i)
      if (parts[i] > 0) place[t[i]] = parts[i];
    const auto at = known.insert({place, static_cast<std::uint32_t>(known.size())});
    if (!at.second) return at.first->second;
    std::map<Index, double> weights;
    for (const auto& [knot, part] : place) {
      const double share = static_cast<double>(part) / n;
      weights[knot] += 0.6 * share;
      for (const Index k : around[knot]) weights[k] += 0.4 * share / static_cast<double>(around[knot].size());
    }
    for (const auto& [knot, weight] : weights)
      skin.binding_knots.push_back(knot), skin.binding_weights.push_back(static_cast<float>(weight));
    skin.binding_start.push_back(static_cast<std::uint32_t>(skin.binding_knots.size()));
    skin.texture_coordinates.push_back({0, 0});
    return at.first->second;
  };
  for (const auto& t : o.contact_triangles) {
    for (int a = 0; a < n; ++a) {
      for (int b = 0; a + b < n; ++b) {
        skin.triangles.push_back({vertex(t, a, b), vertex(t, a + 1, b), vertex(t, a, b + 1)});
        if (a + b + 1 < n)
          skin.triangles.push_back({vertex(t, a + 1, b), vertex(t, a + 1, b + 1), vertex(t, a, b + 1)});
      }
    }
  }
  skin.layer.assign(skin.triangles.size(), 0);
}

/// What a step tells of the skin fits into the room that its delta has from the start.
struct Theatre : test::Theatre {
  std::size_t most_rebound = 0, most_entries = 0, most_removed = 0;

  using test::Theatre::Theatre;
  void step() {
    const std::uint32_t before = world.revision();
    test::Theatre::step();
    std::vector<scene::TopologyDelta> deltas;
    ASSERT_TRUE(world.deltasSince(before, deltas));
    for (const auto& d : deltas) {
      most_rebound = std::max(most_rebound, d.rebound_vertices.size());
      most_entries =
          std::max({most_entries, d.rebound_skin.binding_knots.size(), d.added_skin.binding_knots.size()});
      most_removed = std::max(most_removed, d.removed_triangles.size());
    }
  }
  void steps(int n) {
    for (int i = 0; i < n && !testing::Test::HasFatalFailure(); ++i) step();
  }
  /// Scissors from the front, their plane turned about y: what they do in the i-th step of a cut. They come
  /// open, close, and stay, because the jaws follow late.
  static constexpr int kCut = 180;
  void blades(const Vector3d& tip, int i, double slant = 0.0) {
    input.tools[1] = specimen::toolAt(tools::ToolKind::Scissors,
                                      tip - Vector3d(0, 0.02 * std::max(0.0, 1.0 - i / 60.0), 0),
                                      Vector3d(0, 1, 0), Vector3d(std::sin(slant), 0, std::cos(slant)),
                                      0.9 * std::clamp(2.0 - i / 60.0, 0.0, 1.0));
  }
  void cut(const Vector3d& tip, double slant = 0.0) {
    for (int i = 0; i < kCut && !testing::Test::HasFatalFailure(); ++i) blades(tip, i, slant), step();
  }
  void away() { input.tools[1].present = false; }
  std::size_t pieces(std::vector<std::uint32_t>& part) const { return specimen::pieces(world, 0, part); }
};

/// Vertices of the living skin that hang on knots of two pieces.
std::size_t verticesAcross(const Theatre& t, const std::vector<std::uint32_t>& part) {
  const scene::Topology& now = t.world.topology(0);
  std::set<std::uint32_t> across;
  for (std::size_t i = 0; i < now.skin.triangles.size(); ++i) {
    if (!now.triangle_alive[i]) continue;
    for (const std::uint32_t v : now.skin.triangles[i])
      for (std::uint32_t e = now.skin.binding_start[v]; e < now.skin.binding_start[v + 1]; ++e)
        if (part[now.skin.binding_knots[e]] != part[now.skin.binding_knots[now.skin.binding_start[v]]])
          across.insert(v);
  }
  return across.size();
}

scene::Description scene(scene::Object bar) {
  scene::Description d;
  d.name = "bar", d.hash = "0000000000000003";
  d.gravity.setZero();
  d.objects.push_back(std::move(bar));
  return d;
}

specimen::BarOptions slim() {
  specimen::BarOptions o;
  o.columns = 9, o.rows = 3, o.spacing = 0.003, o.thickness = 0.003, o.mass = 0.003;
  return o;
}

TEST(CutRoom, AFineSkinOpensWithoutAGapHoweverMuchOfItAStepBindsAnew) {
  const Vector3d tip(0.001, 0.0095, 0.05);
  for (const int n : {6, 10, 14}) {
    SCOPED_TRACE(testing::Message() << n << " parts of an edge");
    scene::Object bar = specimen::bar(slim());
    coverFinely(bar, n);
    Theatre t(scene(std::move(bar)));
    t.worst = scene::Status::Ok;  // nothing is left out
    std::vector<std::uint8_t> waiting;
    int from = 0;
    for (int i = 0; i < Theatre::kCut; ++i) {
      t.blades(tip, i), t.step();
      if (!waiting.empty() || !t.world.state().objects[0].cut.unfinished) continue;
      t.world.save(waiting), from = i + 1;
    }
    EXPECT_EQ(waiting.empty(), n < 10) << "the scene shows nothing";
    t.steps(40);
    std::vector<std::uint32_t> part;
    EXPECT_EQ(t.pieces(part), 2u);
    EXPECT_EQ(verticesAcross(t, part), 0u);
    EXPECT_LE(t.most_rebound, 512u);
    EXPECT_LE(t.most_entries, 4096u);
    EXPECT_LE(t.most_removed, 512u);
    if (waiting.empty()) continue;
    Theatre again(t.world.description());
    again.world.restore(waiting);
    for (int i = from; i < Theatre::kCut; ++i) again.blades(tip, i), again.step();
    again.steps(40);
    EXPECT_EQ(again.world.stateHash(), t.world.stateHash());
  }
}

/// A sheet of knots in the plane z = 0.05, its ends held. The link from row 2 to row 3 of its middle column
/// is far too short: it tears at once, and takes the surface on both its sides.
scene::Object sheetThatTears(int n) {
  constexpr int kColumns = 7, kRows = 6;
  constexpr double kSpacing = 0.003;
  scene::Object o;
  o.name = "bar", o.law.youngs_modulus = 20e3, o.tear_strain = 0.5;
  const auto at = [](int x, int y) { return static_cast<Index>(y * kColumns + x); };
  for (int y = 0; y < kRows; ++y) {
    for (int x = 0; x < kColumns; ++x) {
      o.rest_position.push_back(Vector3d(kSpacing * (x - 3), kSpacing * (y - 2.5), 0.05));
      o.mass.push_back(5e-5), o.damping.push_back(2e-4);
      o.fixed.push_back(x == 0 || x + 1 == kColumns);
    }
  }
  o.position = o.rest_position;
  std::set<std::pair<Index, Index>> seen;
  for (int y = 0; y + 1 < kRows; ++y) {
    for (int x = 0; x + 1 < kColumns; ++x) {
      o.contact_triangles.push_back({at(x, y), at(x + 1, y), at(x + 1, y + 1)});
      o.contact_triangles.push_back({at(x, y), at(x + 1, y + 1), at(x, y + 1)});
    }
  }
  for (const auto& t : o.contact_triangles) {
    for (std::size_t e = 0; e < 3; ++e) {
      scene::Link l;
      l.knot0 = std::min(t[e], t[(e + 1) % 3]), l.knot1 = std::max(t[e], t[(e + 1) % 3]);
      if (!seen.insert({l.knot0, l.knot1}).second) continue;
      l.rest = (o.rest_position[l.knot0] - o.rest_position[l.knot1]).norm();
      if (l.knot0 == at(3, 2) && l.knot1 == at(3, 3)) l.rest *= 0.5;
      l.area = 1e-6, l.damping = 0.01;
      o.links.push_back(l);
    }
  }
  coverFinely(o, n);
  return o;
}

// A cut that goes into a hole ends at the hole's edge: what lies on its two sides hangs together by nothing.
TEST(CutRoom, ACutIntoATornHoleDividesTheKnotAtItsEdge) {
  Theatre t(scene(sheetThatTears(3)));
  t.steps(2);
  ASSERT_EQ(t.count(scene::EventKind::Torn), 1u);
  const auto& alive = t.world.state().objects[0].triangle_alive;
  ASSERT_EQ(std::count(alive.begin(), alive.end(), 0), 2);
  t.cut(Vector3d(0.0004, 0.0, 0.05));  // the points end within the hole
  const auto& doubled = t.world.topology(0).doubled_knots;
  EXPECT_EQ(std::set<std::uint32_t>(doubled.begin(), doubled.end()), (std::set<std::uint32_t>{3, 10, 17}));
  for (int i = 0; i < 60; ++i) {
    t.input.tools[1].position.y() -= 0.02 / 60, t.input.tools[1].pivot.y() -= 0.02 / 60;
    t.step();
  }
  t.cut(Vector3d(0.0004, 0.012, 0.05));
  t.away();
  t.steps(40);
  std::vector<std::uint32_t> part;
  EXPECT_EQ(t.pieces(part), 2u);
  EXPECT_EQ(verticesAcross(t, part), 0u);
}

TEST(CutRoom, OfAFineSkinNothingIsLeftOverATear) {
  Theatre t(scene(sheetThatTears(20)));
  t.steps(6);
  ASSERT_EQ(t.count(scene::EventKind::Torn), 1u);
  const auto& s = t.world.state().objects[0];
  int gone = 0;
  for (std::size_t i = 0; i < s.cut.home.size(); ++i) {
    gone += s.topology.triangle_alive[i] == 0;
    ASSERT_TRUE(s.topology.triangle_alive[i] == 0 || s.triangle_alive[s.cut.home[i]] != 0) << i;
  }
  EXPECT_EQ(gone, 800);
  EXPECT_LE(t.most_removed, 512u);
}

// A cord over the cut keeps both halves one piece. Their lips may hang on what lies across the organ; once
// the cord is cut, that is the other piece.
TEST(CutRoom, SkinOfTwoHalvesThatACordHeldTogetherHangsOnItsOwnOnceTheCordIsCut) {
  for (const double slant : {0.0, 0.8, -0.8}) {
    SCOPED_TRACE(testing::Message() << "slant " << slant);
    specimen::BarOptions o = slim();
    o.columns = 11, o.thickness = 0.004;  // m
    scene::Object bar = specimen::bar(o);
    coverFinely(bar, 4);
    const auto apex = static_cast<Index>(bar.position.size());
    bar.position.push_back(Vector3d(0, 0, 0.075));
    bar.rest_position.push_back(bar.position.back());
    bar.mass.push_back(bar.mass[0]), bar.damping.push_back(bar.damping[0]), bar.fixed.push_back(false);
    for (const int column : {1, 9}) {
      scene::Link l;
      l.knot0 = static_cast<Index>(33 + 11 + column), l.knot1 = apex;
      l.rest = (bar.position[l.knot0] - bar.position[apex]).norm();
      l.area = 1e-6, l.damping = 0.01;
      bar.links.push_back(l);
    }
    Theatre t(scene(std::move(bar)));
    t.cut(Vector3d(0.001, 0.005, 0.05), slant);
    t.away();
    t.steps(40);
    std::vector<std::uint32_t> part;
    ASSERT_EQ(t.pieces(part), 1u) << "the cord";
    ASSERT_EQ(t.count(scene::EventKind::Separated), 0u);
    t.cut(Vector3d(0.006, 0.005, 0.064));
    t.away();
    t.steps(40);
    ASSERT_EQ(t.pieces(part), 2u);
    EXPECT_EQ(t.count(scene::EventKind::Separated), 1u);
    EXPECT_EQ(verticesAcross(t, part), 0u);
  }
}

}  // namespace
