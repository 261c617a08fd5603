// Which knot lies in a thread.
#include <gtest/gtest.h>

#include <cstdlib>
#include <random>

#include "knots.h"
#include "laid_knots.h"
#include "vest_tissue/suture/knot_kind.h"

namespace vest::suture::test {

using namespace specimen;
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

TEST(KnotKind, KnotsThatAreDrawnTightStayWhatTheyAre) {
  // Silk 2-0, its ends drawn apart at 0.2 m/s, the loop held below. Independent of the contacts' own memory.
  for (const int second : {-3, 3}) {
    RodDescription rod = straight(4);
    rod.nodes = thrown({3, second}, 0.006, 0.02, 0.001);
    rod.section = solidSection(0.00016, 975, 8.7e9, 0.4);
    rod.section.bend *= 0.05, rod.section.twist *= 0.05;
    rod.section.friction = 0.3, rod.section.strain_damping = 1e-4, rod.section.damping = 200.0;
    const auto last = static_cast<Index>(rod.nodes.size() - 1);
    Index low = 0;
    for (Index i = 0; i <= last; ++i)
      if (rod.nodes[i].z() < rod.nodes[low].z()) low = i;
    const auto drawn = [&rod](Index i) {
      const Vector3d x = rod.nodes[i];
      return HeldNode{i,
                      Hold::Place,
                      {{0.0, x, 0.0}, {0.3, x + 0.06 * Vector3d(x.x() > 0.0 ? 1.0 : -1.0, 0.0, 0.3), 0.0}}};
    };
    rod.held = {drawn(0), {low, Hold::Place, {}}, drawn(last)};
    Moving m(rod);
    KnotScratch scratch(rod.nodes.size());
    for (int k = 0; k < 120; ++k) {
      ASSERT_EQ(step(m.model, m.state, m.scratch, 0.001), StepStatus::Ok) << second << ' ' << k;
      const KnotKind kind = suture::kindOf(m.state.position.data(), m.state.position.size(), scratch);
      ASSERT_EQ(kind.determinant, 9) << second << ' ' << k;
      ASSERT_EQ(kind.signature, second < 0 ? 0 : -4) << second << ' ' << k;
    }
    EXPECT_GT(m.scratch.reactions[0].force.norm(), 0.3) << "N: it is tight";
  }
}

TEST(KnotKind, ItsPlaceIsWhereTheEndsGoIntoIt) {
  constexpr double kSpacing = 0.0008, kSize = 0.005;
  for (const double tail : {0.02, 0.03}) {
    for (const Named& knot : kKnots) {
      const std::vector<Vector3d> nodes = thrown(knot.throws, kSize, tail, kSpacing);
      KnotScratch scratch(nodes.size());
      const KnotPlace place = placeOfKnot(nodes.data(), nodes.size(), scratch);
      const std::size_t end = nodes.size() - 1;
      EXPECT_EQ(place.kind.determinant, knot.determinant) << knot.name;
      if (knot.determinant == 1) {
        EXPECT_EQ(place.first, 0U) << knot.name;
        EXPECT_EQ(place.last, end) << knot.name;
        continue;
      }
      // Both tails end within the last throw, which is as long as twice its size.
      const double before = kSpacing * static_cast<double>(place.first),
                   behind = kSpacing * static_cast<double>(end - place.last);
      EXPECT_NEAR(before, tail + kSize, 0.5 * kSize) << knot.name;
      EXPECT_NEAR(behind, tail + kSize, 0.5 * kSize) << knot.name;
      EXPECT_FALSE(suture::kindOf(&nodes[place.first + 1], end - place.first, scratch) == place.kind)
          << knot.name;
      EXPECT_FALSE(suture::kindOf(nodes.data(), place.last, scratch) == place.kind) << knot.name;
    }
  }
}

TEST(KnotKind, ATailThatCurlsBesideItsKnotIsNoPartOfIt) {
  // Taken off it piece by piece, it ends on all sides of the knot by turns.
  constexpr double kSpacing = 0.0004, kSize = 0.002, kTail = 0.014;
  int told = 0;
  for (const double radius : {0.0015, 0.002, 0.003})
    for (const double pitch : {0.2, 0.4})
      for (int turn = 0; turn < 24; ++turn) {
        std::vector<Vector3d> nodes = thrown({5, -3}, kSize, kTail, kSpacing);
        const std::size_t end = nodes.size() - 1, from = end - static_cast<std::size_t>(kTail / kSpacing);
        const Vector3d way = (nodes[from + 1] - nodes[from]).normalized(),
                       across = Eigen::AngleAxisd(kPi / 12.0 * turn, way) * way.unitOrthogonal();
        for (std::size_t i = from; i <= end; ++i) {
          const double angle =
              kSpacing * static_cast<double>(i - from) / radius * std::sqrt(1.0 - pitch * pitch);
          nodes[i] = nodes[from] + radius * (std::sin(angle) * way + (1.0 - std::cos(angle)) * across +
                                             pitch * angle * way.cross(across));
        }
        KnotScratch scratch(nodes.size());
        const KnotPlace place = placeOfKnot(nodes.data(), nodes.size(), scratch);
        if (!(place.kind == KnotKind{15, -2})) continue;  // it curls through the knot
        ++told;
        EXPECT_NEAR(kSpacing * static_cast<double>(end - place.last), kTail + kSize, 0.5 * kSize)
            << radius << ' ' << pitch << ' ' << turn;
      }
  EXPECT_GT(told, 100) << "of 144";
}

TEST(KnotKind, WhatIsTooTangledIsNotTold) {
  std::mt19937 random(1);
  std::vector<Vector3d> nodes;
  for (int k = 0; k < 200; ++k) {
    nodes.emplace_back();
    for (int i = 0; i < 3; ++i) nodes.back()[i] = random() / 4294967296.0;
  }
  EXPECT_EQ(kindOf(nodes).determinant, 0);
}

}  // namespace
}  // namespace vest::suture::test
