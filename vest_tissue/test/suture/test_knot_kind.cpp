// Which knot lies in a thread.
#include <gtest/gtest.h>

#include <cstdlib>
#include <random>

#include "knots.h"
#include "laid_knots.h"
#include "vest_tissue/suture/knot_kind.h"

namespace vest::suture::test {
namespace {

using Eigen::Vector3d;

KnotKind kindOf(const std::vector<Vector3d>& nodes) {
  KnotScratch scratch(nodes.size());
  return suture::kindOf(nodes.data(), nodes.size(), scratch);
}

struct Named {
  const char* name;
  std::vector<int> throws;
  int determinant, signature;  // Rolfsen's table; a sum of knots has product and sum
};
const Named kKnots[] = {{"open", {}, 1, 0},
                        {"crossed", {1}, 1, 0},
                        {"single throw", {3}, 3, -2},
                        {"its mirror", {-3}, 3, 2},
                        {"square", {3, -3}, 9, 0},
                        {"granny", {3, 3}, 9, -4},
                        {"surgeon's", {5, -3}, 15, -2},
                        {"three throws", {3, -3, 3}, 27, -2}};

TEST(KnotKind, ThrowsThatAreLaidAreTold) {
  for (const Named& knot : kKnots) {
    const KnotKind kind = kindOf(thrown(knot.throws, 0.005, 0.03, 0.0008));
    EXPECT_EQ(kind.determinant, knot.determinant) << knot.name;
    EXPECT_EQ(kind.signature, knot.signature) << knot.name;
  }
}

TEST(KnotKind, ItIsTheSameFromAllSidesAndFromBothEnds) {
  std::mt19937 random(5);
  const auto any = [&random] { return random() / 2147483648.0 - 1.0; };
  for (const Named& knot : kKnots) {
    for (int k = 0; k < 20; ++k) {
      std::vector<Vector3d> nodes = thrown(knot.throws, 0.005, 0.03, 0.0008);
      const Eigen::Quaterniond turn = Eigen::Quaterniond(any(), any(), any(), any()).normalized();
      for (Vector3d& x : nodes) x = turn * x + Vector3d(0.3, -0.2, 0.1);
      if (k % 2 == 1) std::reverse(nodes.begin(), nodes.end());
      const KnotKind kind = kindOf(nodes);
      EXPECT_EQ(kind.determinant, knot.determinant) << knot.name << ' ' << k;
      EXPECT_EQ(kind.signature, knot.signature) << knot.name << ' ' << k;
    }
  }
}

TEST(KnotKind, AnOverhandKnotIsThrownAndAStraightThreadIsNot) {
  EXPECT_EQ(kindOf(overhand(150, 0.001, 0.13).nodes).determinant, 3);
  EXPECT_EQ(kindOf(straight(20).nodes).determinant, 1);
  EXPECT_EQ(kindOf({}).determinant, 1);
}

TEST(KnotKind, WhatIsTooTangledIsNotTold) {
  std::mt19937 random(1);
  std::vector<Vector3d> nodes;
  for (int k = 0; k < 200; ++k) {
    nodes.emplace_back();
    for (double& x : nodes.back()) x = random() / 4294967296.0;
  }
  EXPECT_EQ(kindOf(nodes).determinant, 0);
}

}  // namespace
}  // namespace vest::suture::test
