#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>

#include "beam.h"
#include "vest_tissue/fem/simulate.h"

namespace vest::fem::test {

using namespace specimen;
namespace {

bool fullRun() {
  return std::getenv("VEST_FULL") != nullptr;
}

Options equilibrium(int threads = 1) {
  Options o;
  o.equilibrium = true;
  o.threads = threads;
  return o;
}

TEST(PatchTest, LinearFieldOnTheBoundaryGivesItInsideToo) {
  const Box b{3, 3, 3, 1.0, 1.2, 0.9};
  Description d = makeBox(b, false);
  shake(d, 0.12);
  d.material = {3000.0, 0.4, 0.0, 0.0, 0.0};
  Eigen::Matrix3d A;
  A << 1.0, -2.0, 0.5, 0.7, 3.0, -1.1, 0.2, 0.9, -2.5;
  for (int i = 0; i <= b.nx; ++i)
    for (int j = 0; j <= b.ny; ++j)
      for (int k = 0; k <= b.nz; ++k) {
        const bool inner = i % b.nx != 0 && j % b.ny != 0 && k % b.nz != 0;
        const Index n = b.node(i, j, k);
        if (!inner) d.prescribed.push_back({n, 1e-3 * (A * d.nodes[n])});
      }
  const Result r = simulate(d, equilibrium());
  double inner_error = 0.0;
  for (std::size_t n = 0; n < d.nodes.size(); ++n) {
    inner_error = std::max(inner_error, (r.positions[n] - d.nodes[n] - 1e-3 * (A * d.nodes[n])).norm());
  }
  EXPECT_LT(inner_error, 1e-13);  // of displacements of some 1e-3: 1e-10 relative
}

TEST(Reciprocity, WorkOfOneLoadOnTheOtherDisplacementIsMutual) {
  Description d = makeBox({5, 2, 2, 1.0, 0.4, 0.3});
  shake(d, 0.05);
  Description first = d, second = d;
  first.loads = {{40, {1.0, -0.4, 0.2}}, {30, {0.0, 0.3, -0.7}}};
  second.loads = {{52, {-0.3, 0.8, 0.1}}, {33, {0.6, 0.0, 0.9}}};
  const Result r1 = simulate(first, equilibrium()), r2 = simulate(second, equilibrium());
  double w12 = 0.0, w21 = 0.0;
  for (const Load& l : first.loads) w12 += l.force.dot(r2.positions[l.node] - d.nodes[l.node]);
  for (const Load& l : second.loads) w21 += l.force.dot(r1.positions[l.node] - d.nodes[l.node]);
  EXPECT_GT(std::abs(w12), 1e-9);
  EXPECT_NEAR(w12, w21, 1e-12 * std::abs(w12) + 1e-16);
}

TEST(Reactions, BalanceLoadsAndWeightInBothStrains) {
  for (const Strain strain : {Strain::Small, Strain::Corotational}) {
    Description d = makeBox({6, 2, 2, 2.0, 0.5, 0.5});
    d.strain = strain;
    d.loads = {{20, {0.3, -0.4, 0.2}}, {60, {0.0, 0.5, -1.0}}};
    Options o = equilibrium();
    o.gravity = {0.0, -9.0, 0.0};
    const Result r = simulate(d, o);
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (const auto& f : r.reactions) sum += f;
    const Eigen::Vector3d applied = Eigen::Vector3d(0.3, 0.1, -0.8) + 2.0 * 0.5 * 0.5 * 1.0 * o.gravity;
    EXPECT_LT((sum + applied).norm(), 1e-8 * applied.norm());
  }
}

TEST(Bar, LengthensAndNarrowsAsHookeSays) {
  // Uniaxial stress needs a slide at the clamp: hold x = 0 by prescribing the exact lateral contraction
  // there.
  const Box b{4, 2, 2, 1.0, 0.2, 0.2};
  Description d = makeBox(b, false);
  d.material = {5000.0, 0.3, 0.0, 0.0, 0.0};
  const double stress = 10.0, strain = stress / 5000.0;
  for (int j = 0; j <= 2; ++j)
    for (int k = 0; k <= 2; ++k) {
      const Index n = b.node(0, j, k);
      d.prescribed.push_back({n, {0.0, -0.3 * strain * d.nodes[n].y(), -0.3 * strain * d.nodes[n].z()}});
    }
  loadEnd(d, b, {stress * 0.04, 0.0, 0.0});
  // A load spread by area makes constant stress only if it is consistent with the triangles of the end:
  // integrate it.
  d.loads.clear();
  for (const auto& t : d.tetrahedra) {
    std::array<Index, 3> face{};
    std::size_t count = 0;
    for (Index n : t)
      if (d.nodes[n].x() == 1.0 && count < 3) face[count++] = n;
    if (count != 3) continue;
    const double area =
        0.5 * (d.nodes[face[1]] - d.nodes[face[0]]).cross(d.nodes[face[2]] - d.nodes[face[0]]).norm();
    for (Index n : face) d.loads.push_back({n, {stress * area / 3.0, 0.0, 0.0}});
  }
  const Result r = simulate(d, equilibrium());
  for (std::size_t n = 0; n < d.nodes.size(); ++n) {
    const Eigen::Vector3d expected(strain * d.nodes[n].x(), -0.3 * strain * d.nodes[n].y(),
                                   -0.3 * strain * d.nodes[n].z());
    EXPECT_LT((r.positions[n] - d.nodes[n] - expected).norm(), 1e-12);
  }
}

/// w P-load / (P L³ / 3 E I), 1 in theory (shear adds 0.15 % at this slenderness).
double cantileverRatio(int n) {
  const Box b{20 * n, 1, n, 10.0, 0.6, 0.5};
  Description d = makeBox(b);
  d.material = {1e6, 0.0, 0.0, 0.0, 0.0};
  const double EI = 1e6 * b.ly * b.lz * b.lz * b.lz / 12.0, P = 1e-3;
  loadEnd(d, b, {0.0, 0.0, -P});
  return -endDisplacement(d, b, simulate(d, equilibrium()).positions).z() / (P * 1000.0 / (3.0 * EI));
}

TEST(Cantilever, SmallStrainConvergesToEulerBernoulliWithTheSquareOfTheMesh) {
  const double e4 = 1.0 - cantileverRatio(4), e8 = 1.0 - cantileverRatio(8), e12 = 1.0 - cantileverRatio(12);
  EXPECT_GT(e4, e8);
  EXPECT_GT(e8, e12);
  EXPECT_LT(e12, 0.025);
  EXPECT_NEAR(e4 / e8, 4.0, 1.0);
  // Richardson's extrapolation of the two finest: theory within half a percent.
  EXPECT_NEAR((9.0 * cantileverRatio(12) - 4.0 * cantileverRatio(8)) / 5.0, 1.0, 0.005);
}

TEST(Cantilever, CorotationalFollowsTheElastica) {
  // w/L at PL²/EI (Bisshopp and Drucker 1945, doi 10.1090/qam/13360).
  const std::array<std::array<double, 2>, 4> elastica{
      {{1.0, 0.30172}, {2.0, 0.49346}, {5.0, 0.71379}, {10.0, 0.81061}}};
  const int n = fullRun() ? 24 : 12;
  std::printf("count: %d of 24 elements over the thickness\n", n);
  const double tolerance = fullRun() ? 0.006 : 0.02;
  const Box b{20 * n, 1, n, 10.0, 0.6, 0.5};
  for (std::size_t i = 0; i < (fullRun() ? 4u : 2u); ++i) {
    Description d = makeBox(b);
    d.strain = Strain::Corotational;
    d.material = {1e6, 0.0, 0.0, 0.0, 0.0};
    const double EI = 1e6 * b.ly * b.lz * b.lz * b.lz / 12.0;
    loadEnd(d, b, {0.0, 0.0, -elastica[i][0] * EI / 100.0});
    const Result r = simulate(d, equilibrium());
    EXPECT_LE(r.report.residual, 1e-6 * r.report.load);
    const double w = -endDisplacement(d, b, r.positions).z() / 10.0;
    EXPECT_NEAR(w, elastica[i][1], tolerance * elastica[i][1]) << "PL²/EI = " << elastica[i][0];
  }
}

TEST(Corotational, EqualsSmallStrainForSmallLoads) {
  const Box b{8, 2, 2, 2.0, 0.4, 0.4};
  Description d = makeBox(b);
  loadEnd(d, b, {1e-7, -1e-7, 2e-7});
  const Result small = simulate(d, equilibrium());
  d.strain = Strain::Corotational;
  const Result turned = simulate(d, equilibrium());
  const Eigen::Vector3d us = endDisplacement(d, b, small.positions),
                        ut = endDisplacement(d, b, turned.positions);
  EXPECT_LT((us - ut).norm(), 1e-5 * us.norm());
}

TEST(Static, ThreadsDoNotChangeABit) {
  const Box b{10, 3, 3, 2.0, 0.5, 0.5};
  Description d = makeBox(b);
  d.strain = Strain::Corotational;
  loadEnd(d, b, {0.2, 0.1, -0.6});
  const Result one = simulate(d, equilibrium(1)), two = simulate(d, equilibrium(2)),
               five = simulate(d, equilibrium(5));
  for (std::size_t n = 0; n < d.nodes.size(); ++n) {
    ASSERT_EQ(one.positions[n], two.positions[n]);
    ASSERT_EQ(one.positions[n], five.positions[n]);
  }
}

}  // namespace
}  // namespace vest::fem::test
