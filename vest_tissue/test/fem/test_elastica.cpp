// Large rotations: a slender cantilever of corotational tetrahedra under a dead load at its end, against the
// elastica (Bisshopp and Drucker 1945, doi 10.1090/qam/13360): w/L for P L²/EI.
#include <gtest/gtest.h>

#include <cmath>

#include "beam.h"
#include "vest_tissue/fem/simulate.h"

namespace vest::fem::test {

using namespace specimen;
namespace {

constexpr double kLoad[4] = {1, 2, 5, 10};
constexpr double kElastica[4] = {0.30172, 0.49346, 0.71379, 0.81061};

/// End deflection over length of a bar 1 × 0.025 × 0.05, nu = 0, with `through` cells in its height.
double deflection(int along, int through, double load) {
  const Box b{along, 1, through, 1.0, 0.025, 0.05};
  Description d = makeFiveBox(b);
  d.strain = Strain::Corotational;
  d.material = {1e6, 0.0, 1.0, 0.0, 0.0};
  const double EI = 1e6 * 0.025 * std::pow(0.05, 3) / 12.0;
  loadEnd(d, b, Eigen::Vector3d(0, 0, load * EI));
  Options o;
  o.equilibrium = true;
  return endDisplacement(d, b, simulate(d, o).positions).z();
}

TEST(Elastica, ARefinedCantileverIsWithinTwoPercent) {
  for (int i = 0; i < 4; ++i)
    EXPECT_NEAR(deflection(160, 12, kLoad[i]), kElastica[i], 0.02 * kElastica[i]) << "P L²/EI = " << kLoad[i];
}

TEST(Elastica, TheErrorFallsWithTheSquareOfTheMesh) {
  // Linear tetrahedra are too stiff in bending: it is the mesh, not the law.
  const double coarse = 1.0 - deflection(40, 3, 1.0) / kElastica[0],
               fine = 1.0 - deflection(80, 6, 1.0) / kElastica[0];
  EXPECT_GT(coarse, 0.1);
  EXPECT_GT(coarse / fine, 3.0);
  EXPECT_LT(coarse / fine, 5.0);
}

}  // namespace
}  // namespace vest::fem::test
