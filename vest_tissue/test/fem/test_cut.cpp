// Cutting of tetrahedra along their faces: what comes apart, what stays, and the same motion as of a mesh
// that was built in two pieces.
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <fstream>

#include "cutting.h"
#include "slab.h"

namespace vest::fem::test {

using namespace specimen;
namespace {

using Eigen::Vector3d;

Description beam(Strain strain) {
  Description d = makeBox({8, 3, 3, 0.08, 0.02, 0.02});
  d.strain = strain;
  d.material = {8e3, 0.4, 1050.0, 1.0, 0.002};
  shake(d, 0.0015);
  return d;
}

class Motions : public testing::TestWithParam<Motion> {};
INSTANTIATE_TEST_SUITE_P(TissueCut, Motions, testing::Values(Motion::BackwardEuler, Motion::Elastostatic));

TEST_P(Motions, AWholeCutDividesTheObjectAndKeepsMassAndPlaces) {
  Description d = beam(Strain::Small);
  d.motion = GetParam();
  d.material.youngs_modulus = 60e3;
  Cutting c(d);
  const double before = c.mass();
  EXPECT_EQ(c.parts(), 1u);
  const auto doubled = c.cutAt(0, 0.045, [](const Vector3d&) { return true; });
  EXPECT_EQ(c.parts(), 2u);
  EXPECT_GE(doubled.size(), 16u);
  EXPECT_NEAR(c.mass(), before, 1e-14);
  for (const Doubling& d : doubled) EXPECT_EQ(c.state.x[d.copy], c.state.x[d.original]);
  // Every element has the knots of its own side: no knot of both.
  std::vector<std::uint32_t> root(c.state.corner.size());
  tissueParts(*c.model, c.state, root);
  std::vector<int> part(c.state.x.size(), -1);
  for (std::size_t e = 0; e < root.size(); ++e) {
    std::uint32_t r = root[e];
    while (root[r] != r) r = root[r];
    for (const Index k : c.state.corner[e]) {
      if (part[k] < 0) part[k] = static_cast<int>(r);
      ASSERT_EQ(part[k], static_cast<int>(r)) << "knot " << k;
    }
  }
  // The held end stays, the other falls freely: g t²/2 less what the implicit step takes.
  useFactor(c.state);
  const Vector3d g(0, 0, -9.81);
  for (int i = 0; i < 100; ++i) c.step(g);
  double lowest = 1.0, held = 0.0;
  for (std::size_t k = 0; k < c.state.x.size(); ++k) {
    const double fallen = c.state.x[k].z() - c.model->model->description.nodes[c.state.origin[k]].z();
    if (part[k] == 0) held = std::max(held, std::fabs(fallen));
    if (part[k] != 0) lowest = std::min(lowest, fallen);
  }
  EXPECT_LT(held, 0.01);
  EXPECT_NEAR(lowest, -0.5 * 9.81 * 0.01, 0.005);
}

TEST(TissueCut, APartialCutKeepsItsTipWhole) {
  Cutting c(beam(Strain::Small));
  const auto doubled = c.cutAt(0, 0.045, [](const Vector3d& p) { return p.z() > 0.008; });
  EXPECT_EQ(c.parts(), 1u);
  ASSERT_GE(doubled.size(), 4u);
  EXPECT_LE(doubled.size(), 14u);
  for (const Doubling& d : doubled)
    EXPECT_GT(c.state.x[d.copy].z(), 0.004) << "below the cut nothing is doubled";
}

TEST(TissueCut, MovesLikeAFreshModelOfTheCutMesh) {
  for (const Strain strain : {Strain::Small, Strain::Corotational}) {
    for (const double depth : {0.009, -1.0}) {
      Cutting c(beam(strain));
      c.cutAt(0, 0.045, [depth](const Vector3d& p) { return p.z() > depth; });
      Cutting fresh(cutDescription(*c.model, c.state));
      ASSERT_EQ(fresh.state.x.size(), c.state.x.size());
      for (std::size_t k = 0; k < c.state.x.size(); ++k)
        ASSERT_NEAR(fresh.state.mass[k], c.state.mass[k], 1e-12 * c.state.mass[k] + 1e-20);
      // To the end here; in a World the iterations are bounded, and what is left is announced.
      c.scratch.most_iterations = fresh.scratch.most_iterations = 400;
      const Vector3d g(0, 2.0, -9.81);
      int most = 0;
      for (int i = 0; i < 60; ++i) {
        c.step(g);
        fresh.step(g);
        most = std::max(most, c.scratch.iterations);
      }
      double error = 0.0, size = 0.0;
      for (std::size_t k = 0; k < c.state.x.size(); ++k) {
        error = std::max(error, (c.state.x[k] - fresh.state.x[k]).norm());
        size = std::max(size, (fresh.state.x[k] - fresh.model->model->description.nodes[k]).norm());
      }
      EXPECT_LT(error, 1e-6 * size) << "strain " << int(strain) << " depth " << depth;
      EXPECT_LT(most, 200);
      std::printf("iterations %d\n", most);
    }
  }
}

/// A beam that is held at both its ends, so that both parts of it are.
Description bridge(Motion motion) {
  Description d = beam(Strain::Small);
  d.motion = motion;
  for (Index n = 0; n < d.nodes.size(); ++n)
    if (d.nodes[n].x() > 0.0795) d.fixed.push_back(n);
  return d;
}

TEST_P(Motions, ContactsMeetTheAnswersOfAFreshModelOfTheCutMesh) {
  // Cut through, and with a tip that stays whole. A contact with a freed flap that was given the answer of
  // the whole body was thrown at any speed.
  for (const double depth : {0.009, -1.0}) {
    const Description d = GetParam() == Motion::Elastostatic ? bridge(GetParam()) : beam(Strain::Small);
    Cutting c(d);
    const auto doubled = c.cutAt(0, 0.045, [depth](const Vector3d& p) { return p.z() > depth; });
    useFactor(c.state);
    Cutting fresh(cutDescription(*c.model, c.state));
    // Each copy, and every seventh of the other knots: held ones, outer ones, inner ones at the tip.
    std::vector<Index> knots;
    for (const Doubling& two : doubled) knots.push_back(two.copy), knots.push_back(two.original);
    for (Index k = 0; k < c.state.x.size(); k += 7) knots.push_back(k);
    std::vector<Index> surface(d.nodes.size(), 0);
    for (const auto& face : c.model->surface)
      for (const Index n : face) surface[n] = 1;
    std::size_t laid_open = 0;
    for (const Index k : knots) {
      const Index o = c.state.origin[k];
      const bool free = c.model->model->unknown[o] >= 0;
      if (free && fresh.model->answer_number[k] < 0) continue;  // no contact reaches it
      laid_open += free && k == o && surface[o] == 0;
      TissuePoint point;
      point.knots = {k, doubled[0].copy, doubled[0].original};
      point.weights = {0.5, 0.2, 0.3};
      if (c.scratch.points.size() < kMostTissuePoints) c.scratch.points.push_back(point);
    }
    EXPECT_GT(laid_open, 0u) << "nothing was said of inner knots";
    for (const double h : {c.h, 0.5 * c.h})
      EXPECT_LT(answerError(c, fresh, h), 1e-9) << "depth " << depth << " h " << h;
  }
}

/// N: greatest force on a free knot that nothing balances, loads of gravity among them.
double unbalanced(Cutting& c, const Vector3d& gravity) {
  tissueForces(*c.model, c.state, c.scratch);
  double most = 0.0;
  for (Index k = 0; k < c.state.x.size(); ++k)
    if (c.model->model->unknown[c.state.origin[k]] >= 0)
      most = std::max(most, (c.scratch.force[k] + c.state.mass[k] * gravity).norm());
  return most;
}

TEST(TissueCut, AnElastostaticObjectStaysInEquilibriumCutAndDenatured) {
  // It went on by backward Euler, and swung.
  const Vector3d gravity(0, 1.0, -3.0);
  for (const double depth : {0.009, -1.0}) {
    Cutting c(bridge(Motion::Elastostatic));
    c.cutAt(0, 0.045, [depth](const Vector3d& p) { return p.z() > depth; });
    useFactor(c.state);
    const double load = *std::max_element(c.state.mass.begin(), c.state.mass.end()) * gravity.norm();
    c.step(gravity);
    EXPECT_LT(unbalanced(c, gravity), 1e-9 * load) << "depth " << depth << ", one step after the cut";
    const auto cold = c.state.x;
    c.state.denatured.assign(c.state.corner.size(), 0.0f);
    for (std::size_t e = 0; e < c.state.corner.size(); e += 3) c.state.denatured[e] = 0.5f;
    for (int i = 0; i < 10; ++i) c.step(gravity);
    EXPECT_LT(unbalanced(c, gravity), 1e-4 * load) << "depth " << depth << ", denatured";
    EXPECT_GT((c.state.x.back() - cold.back()).norm(), 1e-5);
  }
}

TEST(TissueCut, AClipOnAnElastostaticObjectLeavesTheRestInEquilibrium) {
  const Vector3d gravity(0, 0.0, -3.0);
  Cutting c(bridge(Motion::Elastostatic));
  useFactor(c.state);
  const double load = *std::max_element(c.state.mass.begin(), c.state.mass.end()) * gravity.norm();
  TissueGroup group;
  for (Index k = 0; k < c.state.x.size(); ++k)
    if (std::fabs(c.state.x[k].x() - 0.04) < 0.004) {
      group.knots[group.count] = k;
      Vector3d goal = c.state.x[k];
      goal.y() = 0.01 + 0.8 * (goal.y() - 0.01);  // pressed to 0.8 of its width
      group.goal[group.count++] = goal;
    }
  ASSERT_GE(group.count, 9);
  prepareGroup(group);
  c.scratch.groups = {group};
  for (int i = 0; i < 10; ++i) c.step(gravity);
  tissueForces(*c.model, c.state, c.scratch);
  Vector3d sum = Vector3d::Zero(), moment = sum;
  for (int i = 0; i < group.count; ++i) {
    const Index k = group.knots[i];
    const Vector3d f = c.scratch.force[k] + c.state.mass[k] * gravity;
    sum += f;
    moment += group.arm[i].cross(f);
    c.scratch.force[k] = -c.state.mass[k] * gravity;  // the clip balances the rest
  }
  EXPECT_LT(sum.norm(), 1e-3 * load) << "of forces on the clip";
  EXPECT_LT(moment.norm(), 1e-3 * load * 0.01);
  double rest = 0.0;
  for (Index k = 0; k < c.state.x.size(); ++k)
    if (c.model->model->unknown[c.state.origin[k]] >= 0)
      rest = std::max(rest, (c.scratch.force[k] + c.state.mass[k] * gravity).norm());
  EXPECT_LT(rest, 1e-3 * load);
}

TEST(TissueCut, TheSoftestAnswerIsThatOfTheCutMesh) {
  Cutting c(bridge(Motion::Elastostatic));
  c.cutAt(0, 0.045, [](const Vector3d& p) { return p.z() > 0.009; });
  useFactor(c.state);
  const Cutting fresh(cutDescription(*c.model, c.state));
  ASSERT_TRUE(c.scratch.cut->renew(*c.model, c.state));
  const double softest = c.scratch.cut->softest(*c.model, c.state), greatest = fresh.model->softest / 1.1;
  EXPECT_GE(softest, greatest) << "a bound";
  EXPECT_LE(softest, 1.11 * greatest);
}

TEST(TissueCut, HoweverMuchIsCutItsStepsTakeOneFactorAndOneSolve) {
  // An update of the whole object's factor had room for 128 knots; beyond it a step took 24 iterations and
  // more, and contacts had answers of tissue that was gone.
  for (const Strain strain : {Strain::Small, Strain::Corotational}) {
    Cutting c(slab({strain, Motion::BackwardEuler, 54e3, 1050.0, 10, 7, 3, true, "slab"}), 1200);
    const std::size_t whole = c.state.x.size();
    int most = 0, cuts = 0;
    const auto cut = [&](int axis, double place) {
      c.cutAt(axis, place, [](const Vector3d& p) { return p.z() > 0.005; });
      ++cuts;
      for (int i = 0; i < 3; ++i) {
        c.step(Vector3d(0, 0, -9.81));
        most = std::max(most, c.scratch.iterations);
      }
      EXPECT_EQ(c.scratch.cut->made(), static_cast<std::uint64_t>(cuts));
    };
    for (int i = 1; i < 10; ++i) cut(0, -0.03 + 0.006 * i);
    for (int i = 1; i < 7; ++i) cut(1, -0.02 + 0.04 / 7 * i);
    EXPECT_GT(c.state.x.size() - whole, 300u);
    EXPECT_LE(most, strain == Strain::Small ? 1 : 8);
    std::printf("%zu copies, %d iterations\n", c.state.x.size() - whole, most);
  }
}

TEST(TissueCut, RoomThatIsUsedUpLeavesTheRestWhole) {
  Cutting c(beam(Strain::Small), 3);
  std::vector<Index> knots;
  for (std::uint32_t e = 0; e < c.state.corner.size(); ++e)
    for (int f = 0; f < 4; ++f) openFace(*c.model, c.state, faceCode(e, f));
  for (Index n = 0; n < c.state.x.size(); ++n) knots.push_back(n);
  std::vector<Doubling> out;
  out.reserve(500);
  const double before = c.mass();
  EXPECT_FALSE(divideKnots(*c.model, c.state, knots, out));
  EXPECT_EQ(out.size(), 3u);
  EXPECT_NEAR(c.mass(), before, 1e-14);
  for (const auto& corner : c.state.corner)
    for (const Index k : corner) EXPECT_LT(k, c.state.x.size());
  for (int i = 0; i < 20; ++i) c.step(Vector3d(0, 0, -9.81));
}

/// MB of this program that lie in memory.
double resident() {
  std::ifstream file("/proc/self/statm");
  long whole = 0, pages = 0;
  file >> whole >> pages;
  return 1e-6 * static_cast<double>(pages) * static_cast<double>(sysconf(_SC_PAGESIZE));
}

TEST(TissueCut, RoomForCutsLiesInMemoryOnceSomethingIsCut) {
  Description d = makeBox({14, 9, 9, 0.14, 0.09, 0.09});
  d.material = {8e3, 0.4, 1050.0, 1.0, 0.002};
  const auto model = makeTissue(d, Motion::BackwardEuler, "");
  prepareTissue(*model, 0.001);
  const double before = resident();
  const CutFactor factor(*model, d.nodes.size() + 200);
  EXPECT_LT(resident() - before, 4.0) << "MB, of about 45";
}

}  // namespace
}  // namespace vest::fem::test
