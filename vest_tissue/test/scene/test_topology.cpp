#include <gtest/gtest.h>

#include <algorithm>

#include "nets.h"
#include "vest_tissue/scene/request.h"
#include "vest_tissue/scene/topology.h"
#include "vest_tissue/scene/world_model.h"

namespace {

using namespace vest;
using net::Block;

TEST(Topology, ACutThroughAKnotKeepsMassAndIndicesAndCountsRevisions) {
  const auto model = scene::buildModel(specimen::tubeScene());
  scene::WorldState s = model->start;
  auto& o = s.objects[0];
  const auto total = [&] {
    double m = 0;
    for (std::size_t i = 0; i < o.block.knots(); ++i) m += o.block.row(Block::kMass)[i];
    return m;
  };
  const double mass = total();
  const std::size_t links = o.topology.links.size();
  auto delta = scene::beginDelta(s, 0);
  std::uint32_t copy = 0;
  ASSERT_TRUE(scene::doubleKnot(s, 0, 40, copy, delta));
  EXPECT_EQ(copy, 128u);
  std::uint32_t moved = 0;
  for (std::uint32_t i = 0; i < links && moved < 2; ++i) {
    const auto l = o.topology.links[i];
    if (l.knot0 != 40 && l.knot1 != 40) continue;
    ASSERT_TRUE(scene::moveLinkEnd(s, 0, i, 40, copy, delta));
    EXPECT_FALSE(o.topology.link_alive[i]) << "its place stays";
    EXPECT_FALSE(scene::removeLink(s, 0, i, delta)) << "dead links do not die again";
    ++moved;
  }
  scene::endDelta(s, delta);
  EXPECT_EQ(moved, 2u);
  EXPECT_EQ(o.topology.links.size(), links + 2);
  EXPECT_EQ(delta.removed_links.size(), 2u);
  EXPECT_EQ(delta.doubled_knots, std::vector<std::uint32_t>{40});
  EXPECT_EQ(delta.revision, delta.from_revision + 1);
  EXPECT_NEAR(total(), mass, 1e-9);
  EXPECT_TRUE(o.topology.links.back().knot0 == copy || o.topology.links.back().knot1 == copy);
}

TEST(Topology, AnAnchorGoesToTheSideOfTheCutOnWhichItLies) {
  net::Anchor a;
  a.knots = {3, 4, 5, 0};
  a.weights = {0.2, 0.3, 0.5, 0.0};
  const net::KnotDoubling cut{4, 9, Eigen::Vector3d::UnitX(), Eigen::Vector3d::Zero()};
  net::Anchor stays = a;
  EXPECT_FALSE(net::remap(stays, cut, Eigen::Vector3d(-0.01, 0, 0)));
  EXPECT_TRUE(net::remap(a, cut, Eigen::Vector3d(0.01, 0, 0)));
  EXPECT_EQ(a.knots[1], 9u);
  EXPECT_EQ(stays.knots[1], 4u);
}

/// Everything that a reader of deltas knows of an object.
void expectSame(const scene::Topology& a, const scene::Topology& b) {
  EXPECT_EQ(a.revision, b.revision);
  ASSERT_EQ(a.links.size(), b.links.size());
  for (std::size_t i = 0; i < a.links.size(); ++i) {
    const scene::Link &l = a.links[i], &m = b.links[i];
    EXPECT_TRUE(l.kind == m.kind && l.knot0 == m.knot0 && l.knot1 == m.knot1 && l.knot2 == m.knot2 &&
                l.rest == m.rest && l.area == m.area && l.stiffness == m.stiffness && l.damping == m.damping)
        << i;
  }
  EXPECT_EQ(a.link_alive, b.link_alive);
  EXPECT_EQ(a.triangle_alive, b.triangle_alive);
  EXPECT_EQ(a.doubled_knots, b.doubled_knots);
  EXPECT_EQ(a.skin.binding_start, b.skin.binding_start);
  EXPECT_EQ(a.skin.binding_knots, b.skin.binding_knots);
  EXPECT_EQ(a.skin.binding_weights, b.skin.binding_weights);
  EXPECT_EQ(a.skin.texture_coordinates, b.skin.texture_coordinates);
  EXPECT_EQ(a.skin.triangles, b.skin.triangles);
  EXPECT_EQ(a.skin.layer, b.skin.layer);
}

/// Two tubes with a skin vertex a knot (half of it on the knot, half on the next ring's), tied together.
scene::Description tornScene(double break_force, double tear_strain) {
  scene::Description d = specimen::tubeScene();
  specimen::TubeOptions o;
  o.name = "other";
  o.centre = Eigen::Vector3d(0, 0.03, 0.05);
  d.objects.push_back(specimen::tube(o));
  for (scene::Object& t : d.objects) {
    t.skin.binding_start.push_back(0);
    for (scene::Index k = 0; k + 8 < t.position.size(); ++k) {
      for (const scene::Index n : {k, k + 8})
        t.skin.binding_knots.push_back(n), t.skin.binding_weights.push_back(0.5f);
      t.skin.binding_start.push_back(static_cast<std::uint32_t>(t.skin.binding_knots.size()));
      t.skin.texture_coordinates.push_back({0.f, 0.f});
    }
    t.tear_strain = tear_strain;
  }
  scene::Connection c;
  c.object0 = "tube", c.object1 = "other";
  c.knot0 = 64;
  c.triangle1 = {64, 65, 72};
  c.weights1 = {0.5, 0.25, 0.25};
  for (int k = 0; k < 3; ++k) c.offset -= c.weights1[k] * d.objects[1].position[c.triangle1[k]];
  c.offset += d.objects[0].position[64];
  c.stiffness = 50, c.damping = 0.01, c.break_force = break_force;
  d.connections.push_back(c);
  return d;
}

scene::Status steps(scene::World& w, int count, scene::StepReport& report) {
  scene::StepInput in;
  scene::Status worst = scene::Status::Ok;
  for (int i = 0; i < count; ++i) {
    in.step = w.steps() + 1;
    worst = std::max(worst, w.step(in, report));
  }
  return worst;
}

TEST(Deltas, OldTopologyAndDeltasGiveTheNewTopologyExactly) {
  scene::World w(tornScene(0, 0));
  std::vector<scene::Topology> reader{w.topology(0), w.topology(1)};
  std::uint32_t copy = 0;
  ASSERT_TRUE(w.removeLink(0, 17));
  EXPECT_FALSE(w.removeLink(0, 17)) << "dead already";
  ASSERT_TRUE(w.splitKnot(1, 64, Eigen::Vector3d::UnitX(), copy));
  EXPECT_EQ(copy, 128u);
  ASSERT_TRUE(w.splitKnot(1, 65, Eigen::Vector3d::UnitX(), copy));
  EXPECT_FALSE(w.splitKnot(1, 128, Eigen::Vector3d::UnitY(), copy)) << "all its tissue is on one side";
  ASSERT_TRUE(w.splitKnot(1, 128, Eigen::Vector3d::UnitZ(), copy)) << "a copy can be split again";
  EXPECT_FALSE(w.splitKnot(1, 9999, Eigen::Vector3d::UnitX(), copy));
  EXPECT_FALSE(w.splitKnot(0, 3, Eigen::Vector3d::Zero(), copy));
  ASSERT_TRUE(w.removeLink(1, static_cast<std::uint32_t>(w.topology(1).links.size() - 1)));
  std::vector<scene::TopologyDelta> deltas;
  ASSERT_TRUE(w.deltasSince(0, deltas));
  ASSERT_EQ(deltas.size(), 5u);
  EXPECT_FALSE(deltas[1].rebound_vertices.empty()) << "the skin goes with the copy";
  EXPECT_FALSE(deltas[1].added_links.empty());
  std::uint32_t revision = 0;
  for (const auto& d : deltas) {
    EXPECT_EQ(d.from_revision, revision);
    revision = d.revision;
    ASSERT_TRUE(scene::applyDelta(reader[d.object], d));
  }
  EXPECT_EQ(revision, w.revision());
  for (std::size_t i = 0; i < 2; ++i) expectSame(reader[i], w.topology(i));
  scene::Topology twice = reader[1];
  EXPECT_FALSE(scene::applyDelta(twice, deltas[1])) << "of another revision";
  expectSame(twice, reader[1]);
  EXPECT_EQ(scene::originalKnot(w.topology(1), 128, copy), 64u);
  scene::StepReport report;
  EXPECT_EQ(steps(w, 200, report), scene::Status::Ok) << "a cut tube goes on";
}

TEST(Deltas, AreTooOldOnlyPastTheHistory) {
  scene::World w(tornScene(0, 0));
  std::vector<scene::TopologyDelta> deltas;
  for (std::uint32_t i = 0; i < scene::kDeltaHistory + 10; ++i) ASSERT_TRUE(w.removeLink(0, i));
  const std::uint32_t oldest = w.revision() - static_cast<std::uint32_t>(scene::kDeltaHistory);
  EXPECT_TRUE(w.deltasSince(oldest, deltas));
  EXPECT_EQ(deltas.size(), scene::kDeltaHistory);
  EXPECT_EQ(deltas.front().from_revision, oldest);
  EXPECT_FALSE(w.deltasSince(oldest - 1, deltas)) << "send the whole topology";
  EXPECT_TRUE(w.deltasSince(w.revision(), deltas));
  EXPECT_TRUE(deltas.empty());
  w.reset();
  EXPECT_FALSE(w.deltasSince(oldest, deltas)) << "a revision that is not of this history";
}

TEST(Deltas, ATornConnectionAndATornLinkMakeOne) {
  scene::World connection(tornScene(1e-4, 0)), link(tornScene(0, 0.02));
  scene::StepReport report;
  std::vector<scene::TopologyDelta> deltas;
  scene::StepInput in;
  in.impacts.push_back({1, 60, {0.3, 0.3, 0.4}, Eigen::Vector3d(0, 4e-5, 0)});
  for (scene::World* w : {&connection, &link}) {
    bool torn = false;
    std::vector<scene::Topology> reader{w->topology(0), w->topology(1)};
    for (int i = 0; i < 40; ++i) {
      ASSERT_NE(w->step(in, report), scene::Status::Fault);
      for (const auto& e : report.events) torn = torn || e.kind == scene::EventKind::Torn;
      if (i == 10) in.impacts.clear();
    }
    in.impacts.push_back({1, 60, {0.3, 0.3, 0.4}, Eigen::Vector3d(0, 4e-5, 0)});
    EXPECT_TRUE(torn);
    EXPECT_GT(w->revision(), 0u);
    ASSERT_TRUE(w->deltasSince(0, deltas));
    ASSERT_FALSE(deltas.empty());
    EXPECT_EQ(deltas.back().revision, w->revision());
    for (const auto& d : deltas) EXPECT_TRUE(scene::applyDelta(reader[d.object], d));
    for (std::size_t i = 0; i < 2; ++i) expectSame(reader[i], w->topology(i));
  }
  EXPECT_EQ(connection.topology(0).revision, 0u) << "its own lists stayed";
  EXPECT_GT(std::count(link.topology(1).link_alive.begin(), link.topology(1).link_alive.end(), 0), 0);
}

TEST(Deltas, RequestsOfAStepDoTheSameAndSurviveTheWireHashAndSnapshot) {
  const scene::Description d = tornScene(0, 0);
  scene::World a(d), b(d);
  scene::StepReport report;
  steps(a, 3, report), steps(b, 3, report);
  const auto whole = a.stateHash();
  ASSERT_EQ(whole, b.stateHash());
  const Eigen::Vector3d normal(1.0 / 3, 0.1, 0);
  std::uint32_t copy = 0;
  ASSERT_TRUE(a.removeLink(0, 5));
  ASSERT_TRUE(a.splitKnot(1, 64, normal, copy));
  EXPECT_NE(a.stateHash(), whole) << "topology is State";
  steps(a, 1, report);
  scene::StepInput in;
  in.requests.push_back({scene::TopologyRequest::Kind::RemoveLink, 0, 5, {}});
  in.requests.push_back({scene::TopologyRequest::Kind::SplitKnot, 1, 64, normal});
  for (auto& r : in.requests) r = scene::parseRequest(scene::requestText(r, d), d);
  b.step(in, report);
  EXPECT_EQ(a.stateHash(), b.stateHash());
  for (const char* wrong :
       {"", "cut tube 1", "remove_link tube", "remove_link nobody 3", "split_knot tube 3 0 0 0",
        "split_knot tube 3 1 0", "remove_link tube 3 more", "remove_link tube -1x"}) {
    EXPECT_THROW(scene::parseRequest(wrong, d), std::invalid_argument) << wrong;
  }
  std::vector<std::uint8_t> bytes;
  b.save(bytes);
  scene::World c(d);
  c.restore(bytes);
  expectSame(c.topology(1), b.topology(1));
  EXPECT_EQ(c.stateHash(), b.stateHash());
  steps(b, 50, report), steps(c, 50, report);
  EXPECT_EQ(c.stateHash(), b.stateHash());
  c.reset();
  EXPECT_EQ(c.topology(1).links.size(), d.objects[1].links.size());
}

TEST(Deltas, AnchorsOfConnectionsAndGraspsGoToTheirSideOfTheSplit) {
  const auto model = scene::buildModel(tornScene(0, 0));
  scene::WorldState s = model->start;
  auto delta = scene::beginDelta(s, 1);
  auto& held = s.grasps[0];
  held.active = true, held.count = 2;
  const auto& b = s.objects[1].block;
  const Eigen::Vector3d at(b.row(Block::X)[64], b.row(Block::Y)[64], b.row(Block::Z)[64]);
  held.anchors[0].object = held.anchors[1].object = 1;
  held.anchors[0].knot = held.anchors[1].knot = 64;
  held.anchors[0].local = at + Eigen::Vector3d(0.001, 0, 0),
  held.anchors[1].local = at - Eigen::Vector3d(0.001, 0, 0);
  std::uint32_t copy = 0;
  ASSERT_TRUE(scene::splitKnot(s, 1, 64, Eigen::Vector3d::UnitX(), copy, delta));
  EXPECT_EQ(held.anchors[0].knot, copy);
  EXPECT_EQ(held.anchors[1].knot, 64u);
  // The connection ends in a triangle that reaches from knot 64 to the next ring, on the copy's side.
  EXPECT_EQ(s.connections[0].end1.knots[0], copy);
  EXPECT_EQ(s.connections[0].end1.knots[1], 65u);
  EXPECT_EQ(s.connections[0].end0.knots[0], 64u) << "of the other object";
}

}  // namespace
