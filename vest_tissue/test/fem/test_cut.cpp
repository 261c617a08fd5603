// Cutting of tetrahedra along their faces: what comes apart, what stays, and the same motion as of a mesh
// that was built in two pieces.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>

#include "slab.h"
#include "vest_tissue/fem/simulate.h"
#include "vest_tissue/fem/tissue_cut.h"

namespace vest::fem::test {
namespace {

using Eigen::Vector3d;

/// A tissue whose state has room for cuts, and steps of it under gravity.
struct Cutting {
  std::shared_ptr<TissueModel> model;
  TissueState state;
  TissueScratch scratch;
  double h = 0.001;
  std::vector<float> held[3];
  Cutting(const Description& d, std::size_t room = 200) {
    model = makeTissue(d, d.motion, "");
    prepareTissue(*model, h);
    state = tissueAtRest(*model, d.nodes);
    const std::size_t most = d.nodes.size() + room;
    state.x.reserve(most), state.v.reserve(most), state.mass.reserve(most);
    state.origin.reserve(most), state.knot_element.reserve(most);
    scratch = TissueScratch(*model, most);
    for (auto& row : held) row.assign(most, 0.0f);
  }
  /// Opens all faces between elements whose centres lie on two sides of a place along an axis.
  std::vector<Doubling> cutAt(int axis, double place, const std::function<bool(const Vector3d&)>& where) {
    std::vector<Index> knots;
    const auto centre = [&](std::size_t e) {
      Vector3d sum = Vector3d::Zero();
      for (const Index k : state.corner[e]) sum += 0.25 * state.x[k];
      return sum;
    };
    for (std::uint32_t e = 0; e < state.corner.size(); ++e) {
      for (int f = 0; f < 4; ++f) {
        const std::uint32_t other = model->neighbours[e][static_cast<std::size_t>(f)];
        if (other == kNoSlot || other < e) continue;
        const Vector3d p = centre(e), q = centre(other);
        if ((p[axis] < place) == (q[axis] < place) || !where(0.5 * (p + q))) continue;
        EXPECT_TRUE(openFace(*model, state, faceCode(e, f)));
        for (const Index k : faceKnots(state, faceCode(e, f)))
          if (std::find(knots.begin(), knots.end(), k) == knots.end()) knots.push_back(k);
      }
    }
    std::vector<Doubling> out;
    out.reserve(500);
    EXPECT_TRUE(divideKnots(*model, state, knots, out));
    return out;
  }
  void step(const Vector3d& gravity) {
    for (std::size_t k = 0; k < state.x.size(); ++k)
      for (int a = 0; a < 3; ++a) held[a][k] = static_cast<float>(state.mass[k] * gravity[a]);
    scratch.points.clear();
    ASSERT_TRUE(
        freeTissueStep(*model, state, h, {held[0].data(), held[1].data(), held[2].data()}, gravity, scratch));
    ASSERT_TRUE(endTissueStep(*model, state, h, scratch));
  }
  double mass() const { return std::accumulate(state.mass.begin(), state.mass.end(), 0.0); }
  std::uint32_t parts() const {
    std::vector<std::uint32_t> root(state.corner.size());
    return tissueParts(*model, state, root);
  }
};

Description beam(Strain strain) {
  Description d = makeBox({8, 3, 3, 0.08, 0.02, 0.02});
  d.strain = strain;
  d.material = {8e3, 0.4, 1050.0, 1.0, 0.002};
  shake(d, 0.0015);
  return d;
}

TEST(TissueCut, AWholeCutDividesTheObjectAndKeepsMassAndPlaces) {
  Description d = beam(Strain::Small);
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

TEST(TissueCut, ContactsMeetTheAnswersOfAFreshModelOfTheCutMesh) {
  // Small and elastostatic, which has become dynamic; cut through, and with a tip that stays whole. A contact
  // with a freed flap that was given the answer of the whole body was thrown at any speed.
  for (const Motion motion : {Motion::BackwardEuler, Motion::Elastostatic}) {
    for (const double depth : {0.009, -1.0}) {
      Description d = beam(Strain::Small);
      d.motion = motion;
      Cutting c(d);
      const auto doubled = c.cutAt(0, 0.045, [depth](const Vector3d& p) { return p.z() > depth; });
      makeDynamic(c.state);
      Description now = cutDescription(*c.model, c.state);
      now.motion = Motion::BackwardEuler;
      Cutting fresh(now);
      // Each copy, and every seventh of the other knots: held ones, outer ones, inner ones at the tip.
      std::vector<Index> knots;
      for (const Doubling& two : doubled) knots.push_back(two.copy), knots.push_back(two.original);
      for (Index k = 0; k < c.state.x.size(); k += 7) knots.push_back(k);
      std::size_t laid_open = 0;
      for (const Index k : knots) {
        const Index o = c.state.origin[k];
        const bool free = c.model->model->unknown[o] >= 0;
        if (free && fresh.model->answer_number[k] < 0) continue;  // no contact reaches it
        laid_open += free && k == o && c.model->movingNumber()[o] < 0;
        TissuePoint point;
        point.knots = {k, doubled[0].copy, doubled[0].original};
        point.weights = {0.5, 0.2, 0.3};
        if (c.scratch.points.size() < kMostTissuePoints) c.scratch.points.push_back(point);
      }
      EXPECT_GT(laid_open, 0u) << "nothing was said of inner knots";
      fresh.scratch.points = c.scratch.points;
      for (const double h : {c.h, 0.5 * c.h}) {
        answerPoints(*c.model, c.state, h, c.scratch);
        answerPoints(*fresh.model, fresh.state, h, fresh.scratch);
        double error = 0.0, size = 0.0;
        for (std::size_t p = 0; p < c.scratch.points.size(); ++p) {
          for (std::size_t q = 0; q < c.scratch.points.size(); ++q) {
            const auto& is = c.scratch.answers[p * kMostTissuePoints + q];
            const auto& should = fresh.scratch.answers[p * kMostTissuePoints + q];
            error = std::max(error, (is - should).norm());
            size = std::max(size, should.norm());
          }
        }
        EXPECT_LT(error, 1e-9 * size) << "motion " << int(motion) << " depth " << depth << " h " << h;
      }
    }
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

}  // namespace
}  // namespace vest::fem::test
