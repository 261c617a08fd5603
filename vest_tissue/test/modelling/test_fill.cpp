#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include "blades.h"
#include "vest_tissue/base/nearest.h"
#include "vest_tissue/modelling/bake.h"
#include "vest_tissue/modelling/tree.h"
#include "vest_tissue/scene/world.h"

// Protects trees that supply a region: ends all over it, radii and angles by the printed laws, branches that
// do not meet, and messages for what does not fit.

using namespace vest::modelling;

namespace {

TreeSpec supplying(std::uint32_t terminals) {
  TreeSpec spec;
  spec.root = {-0.06, 0, 0};
  spec.radius = 0.0015;
  spec.least = 5e-5;
  spec.region = Region{{0, 0, 0}, {0.04, 0.025, 0.02}};
  spec.terminals = terminals;
  return spec;
}

/// Angle between the ways of a branch and of one that leaves it, rad.
double turned(const TreeBranch& before, const TreeBranch& next) {
  return std::acos(
      std::clamp((before.to - before.from).normalized().dot((next.to - next.from).normalized()), -1.0, 1.0));
}

std::vector<std::vector<std::size_t>> followers(const std::vector<TreeBranch>& tree) {
  std::vector<std::vector<std::size_t>> next(tree.size());
  for (std::size_t i = 0; i < tree.size(); ++i)
    if (tree[i].parent >= 0) next[static_cast<std::size_t>(tree[i].parent)].push_back(i);
  return next;
}

}  // namespace

TEST(Fill, EveryPartOfTheRegionHasItsShareOfTheEnds) {
  const TreeSpec spec = supplying(80);
  const auto tree = fillRegion(spec);
  ASSERT_EQ(tree.size(), 159u) << "two branches for each end but the first";
  const auto next = followers(tree);
  std::array<int, 8> octants{};
  for (std::size_t i = 0; i < tree.size(); ++i) {
    if (!next[i].empty()) {
      EXPECT_EQ(next[i].size(), 2u);
      continue;
    }
    EXPECT_LE(tree[i].to.cwiseQuotient(spec.region->half_axes).norm(), 1.0 + 1e-12);
    ++octants[(tree[i].to.x() > 0) + 2u * (tree[i].to.y() > 0) + 4u * (tree[i].to.z() > 0)];
  }
  // 80 dice on eight places give 10 each, standard deviation 3.
  for (const int ends : octants) EXPECT_NEAR(ends, 10, 6);
  EXPECT_EQ(tree[0].ends, 80u);
  EXPECT_EQ(tree[0].from, spec.root);
}

TEST(Fill, RadiiShareTheFlowAndAnglesAreThoseOfLeastWork) {
  const auto tree = fillRegion(supplying(80));
  const auto next = followers(tree);
  int forks = 0, least_work = 0;
  for (std::size_t i = 0; i < tree.size(); ++i) {
    if (next[i].empty()) continue;
    const TreeBranch &a = tree[next[i][0]], &b = tree[next[i][1]];
    const double r0 = tree[i].radius, x = radiusExponent(r0);
    EXPECT_NEAR(std::pow(a.radius / r0, x) + std::pow(b.radius / r0, x), 1.0, 1e-12);
    EXPECT_NEAR(std::pow(a.radius / b.radius, x), static_cast<double>(a.ends) / b.ends, 1e-9);
    ++forks;
    const double off = std::max(std::abs(turned(tree[i], a) - branchAngle(r0, a.radius, b.radius)),
                                std::abs(turned(tree[i], b) - branchAngle(r0, b.radius, a.radius)));
    least_work += off < 0.01;
  }
  EXPECT_EQ(forks, 79);
  // The others are as short as they may be, or lie against another branch.
  EXPECT_GE(least_work, 2 * forks / 3);
}

TEST(Fill, BranchesKeepClearOfEachOther) {
  const auto tree = fillRegion(supplying(80));
  for (std::size_t i = 0; i < tree.size(); ++i) {
    const double before =
        tree[i].parent < 0 ? tree[i].radius : tree[static_cast<std::size_t>(tree[i].parent)].radius;
    EXPECT_GE((tree[i].to - tree[i].from).norm(), 2 * before * (1 - 1e-9));
    for (std::size_t j = 0; j < i; ++j) {
      if (tree[i].parent == static_cast<int>(j) || tree[i].parent == tree[j].parent ||
          tree[j].parent == static_cast<int>(i))
        continue;
      double s = 0, t = 0;
      EXPECT_GE(vest::contact::nearestSegments(tree[i].from, tree[i].to, tree[j].from, tree[j].to, s, t),
                tree[i].radius + tree[j].radius)
          << i << " and " << j;
    }
  }
}

TEST(Fill, ASeedGivesOneTreeAndAnotherSeedAnotherOne) {
  TreeSpec spec = supplying(20);
  const auto a = fillRegion(spec), b = fillRegion(spec);
  for (std::size_t i = 0; i < a.size(); ++i) EXPECT_EQ(a[i].to, b[i].to);
  spec.seed = 2;
  EXPECT_NE(fillRegion(spec).back().to, a.back().to);
}

TEST(Fill, MoreEndsThanFindAPlaceAreRefused) {
  TreeSpec spec = supplying(200);
  spec.region->half_axes = {0.004, 0.004, 0.004};
  try {
    fillRegion(spec);
    ADD_FAILURE();
  } catch (const std::invalid_argument& error) {
    EXPECT_NE(std::string(error.what()).find("of 200 find a place"), std::string::npos) << error.what();
  }
}

TEST(Fill, ASourceAsksForItAndTheSceneStaysWhereItGrew) {
  const std::string source = R"(vest_source: 1
name: organ
objects:
  - name: tree
    organ: artery
    material: artery
    support: 25
    bulk_modulus: 200
    tree: {root: [-0.03, 0, 0.05], radius: 0.0015, region: {centre: [0, 0, 0.05], half_axes: [0.02, 0.012, 0.01]}, terminals: 12, supply: uterine_branches_left}
    fixed: [{rings: [0, 1]}]
)";
  const auto materials = readMaterials(std::string(VEST_TISSUE_SOURCE_DIR) + "/data/materials.yaml");
  const auto scene = bake(readSource("source.yaml", source), materials);
  EXPECT_EQ(scene.objects.size(), 23u);
  vest::scene::World world(scene);
  vest::scene::StepInput input;
  vest::scene::StepReport report;
  for (int i = 0; i < 200; ++i) {
    input.dt = 1e-3;
    input.step = world.steps();
    ASSERT_EQ(world.step(input, report), vest::scene::Status::Ok);
  }
  EXPECT_LT(vest::specimen::fastestKnot(world), 0.001) << "m/s";

  const auto says = [&](const std::string& from, const std::string& to, const std::string& part) {
    std::string text = source;
    text.replace(text.find(from), from.size(), to);
    try {
      bake(readSource("source.yaml", text), materials);
      ADD_FAILURE() << part;
    } catch (const std::invalid_argument& error) {
      EXPECT_NE(std::string(error.what()).find(part), std::string::npos) << error.what();
    }
  };
  says("terminals: 12", "terminals: 12, axiom: A", "tree.axiom: A: must not be there");
  says("0.012, 0.01]", "-1, 0.01]", "half_axes[1]");
  says("terminals: 12, ", "", "terminals");
  says("terminals: 12", "terminals: 201", "terminals");
}
