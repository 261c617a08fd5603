// E and nu in, springs out, E and nu back: at every mesh density, in tension, compression, shear and bending.
#include <gtest/gtest.h>

#include <cmath>

#include "vest_tissue/modelling/calibration.h"
#include "vest_tissue/scene/world.h"

namespace {

using namespace vest;
using Eigen::Matrix3d;
using Eigen::Vector3d;
using modelling::Lattice;

constexpr double kHeight = 0.02;  // m, of the bar

Lattice bar(int across, double nu, int slenderness = 4) {
  Lattice l;
  l.cells = {across, across, slenderness * across};
  l.cell = kHeight / across;
  l.law.youngs_modulus = 8e3;
  l.poisson_ratio = nu;
  return l;
}

TEST(Calibration, TensionAndShearGiveTheModuliAtEveryMeshDensity) {
  for (const double nu : {0.25, 0.35, 0.45}) {
    for (const int across : {1, 2, 3, 4}) {
      const auto m = modelling::moduliOf(bar(across, nu));
      // The two triangles of a cell's face see no symmetry in a single cell.
      EXPECT_NEAR(m.youngs, 8e3, 8e3 * (across == 1 ? 0.01 : 0.003)) << across << " nu " << nu;
      EXPECT_NEAR(m.poisson, nu, across == 1 ? 0.02 : 0.006) << across << " nu " << nu;
      EXPECT_NEAR(m.shear, 8e3 / (2 * (1 + nu)), 8e3 / (2 * (1 + nu)) * 0.003) << across << " nu " << nu;
    }
  }
}

TEST(Calibration, BendingComesCloserToBeamTheoryWithTheSquareOfTheMeshDensity) {
  double before = 1e9;
  for (const int across : {2, 4, 6}) {
    const double error = std::fabs(modelling::bendingModulus(bar(across, 0.25)) / 8e3 - 1.0);
    EXPECT_LT(error, 1.0 / (across * across)) << across;
    EXPECT_LT(error, before);
    before = error;
  }
}

TEST(Calibration, ABarFollowsTheFourthOrderLawOfTheTissueInTensionAndItsSlopeInCompression) {
  material::Law tissue{8e3, 1.0, 4.0, 0.0, 0.4};
  const auto fit = modelling::fitLinkLaw(tissue, 0.25);
  EXPECT_LT(fit.residual, 0.01);
  Lattice l = bar(2, 0.25);
  l.law = fit.law;
  const auto net = modelling::makeLattice(l);
  for (const double strain : {0.1, 0.2, 0.3, 0.4}) {
    const double stress = material::stress(tissue, strain);
    Matrix3d pull = Matrix3d::Zero();
    pull(2, 2) = stress;
    const auto x = modelling::equilibrium(net, modelling::uniformTraction(l, pull));
    EXPECT_NEAR(modelling::displacementGradient(net, x)(2, 2), strain, 0.01 * strain) << strain;
  }
  for (const double strain : {-0.15, -0.1, -0.05}) {
    // The diagonals turn away from the load: a little softer than the linear slope.
    const double stress = 8e3 * modelling::barResponse(fit.law, 0.25, strain).stress;
    EXPECT_NEAR(stress, material::stress(tissue, strain), 0.15 * 8e3 * -strain) << strain;
  }
}

TEST(Calibration, TheWorldsBarHangsAsLongWhateverTheStepAndTheSubSteps) {
  // Own weight: elongation rho·g·L²/(2 E) at the end, exact for a knot mesh that carries half cells.
  for (const int across : {1, 2}) {
    Lattice l = bar(across, 0.25, 3);
    l.damping_time = 2e-3;
    auto net = modelling::makeLattice(l);
    for (std::size_t i = 0; i < net.mass.size(); ++i) net.damping[i] = 30.0 * net.mass[i];
    for (int i = 0; i <= across; ++i)
      for (int j = 0; j <= across; ++j) net.fixed[l.knot(i, j, 0)] = 1;
    for (const double dt : {1e-3, 2.5e-4}) {
      scene::Description d;
      d.name = "bar";
      d.gravity = {0, 0, 9.81};
      d.dt = dt;
      d.objects.push_back(net);
      scene::World w(d);
      scene::StepInput in;
      in.dt = dt;
      scene::StepReport report;
      for (int i = 0; i < std::lround(1.5 / dt); ++i) ASSERT_EQ(w.step(in, report), scene::Status::Ok);
      std::vector<float> p(3 * w.knotCount(0));
      w.positions(0, p.data());
      const auto end = l.knot(0, 0, 3 * across);
      const double longer = p[3 * end + 2] - net.rest_position[end].z();
      const double length = 3 * kHeight, expected = 1000.0 * 9.81 * length * length / (2 * 8e3);
      // The clamped end may not narrow: stiffer by some percent, as in a solid bar.
      EXPECT_NEAR(longer, expected, 0.08 * expected) << across << " cells, dt " << dt;
    }
  }
}

TEST(Calibration, RefusesWhatSpringsCannotBe) {
  Lattice l = bar(2, 0.1);
  EXPECT_THROW(modelling::makeLattice(l), std::invalid_argument);
  l = bar(2, 0.3);
  l.cell = 0.0;
  EXPECT_THROW(modelling::makeLattice(l), std::invalid_argument);
}

}  // namespace
