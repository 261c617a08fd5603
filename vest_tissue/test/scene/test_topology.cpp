#include <gtest/gtest.h>

#include <algorithm>

#include "nets.h"
#include "vest_tissue/net/net_body.h"
#include "vest_tissue/scene/topology.h"
#include "vest_tissue/scene/world_model.h"

namespace {

using namespace vest;
using net::Block;

TEST(Topology, ACutThroughAKnotKeepsMassAndIndicesAndCountsRevisions) {
  const auto model = scene::buildModel(test::tubeScene());
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

TEST(NetBody, AnImpulseChangesTheMomentumByItselfAndPlacesAreWeighted) {
  const auto model = scene::buildModel(test::tubeScene());
  scene::WorldState s = model->start;
  Block& b = s.objects[0].block;
  net::NetBody body(b, 1e-3, 1e6);
  net::Anchor a;
  a.knots = {40, 41, 48, 0};
  a.weights = {0.5, 0.25, 0.25, 0.0};
  const Eigen::Vector3d impulse(1e-5, -2e-5, 3e-5);
  body.applyImpulse(a, impulse);
  Eigen::Vector3d p = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < b.knots(); ++i) {
    p += b.row(Block::kMass)[i] * Eigen::Vector3d(b.row(Block::VX)[i], b.row(Block::VY)[i], b.row(Block::VZ)[i]);
  }
  EXPECT_LT((p - impulse).norm(), 1e-5 * impulse.norm());
  EXPECT_GT(body.velocity(a).dot(impulse), 0.0);
  EXPECT_NEAR(body.position(a).x(), 0.5 * b.row(Block::X)[40] + 0.25 * b.row(Block::X)[41] + 0.25 * b.row(Block::X)[48], 1e-9);
  EXPECT_GT(body.compliance(a)(0, 0), 0.0);
  EXPECT_EQ(body.compliance(a), body.compliance(a).transpose());
}

}  // namespace
