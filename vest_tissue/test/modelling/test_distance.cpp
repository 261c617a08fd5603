#include <cmath>

#include <gtest/gtest.h>

#include "surface_distance.h"

using vest::tools::Surface;

namespace {

// An ellipsoid, so that the fit has one answer up to its symmetry.
Surface ellipsoid(double a, double b, double c) {
  Surface surface;
  const int rows = 24, columns = 32;
  const double pi = std::acos(-1.0);
  for (int i = 0; i <= rows; ++i) {
    for (int k = 0; k < columns; ++k) {
      const double theta = pi * i / rows, phi = 2 * pi * k / columns;
      surface.points.emplace_back(a * std::sin(theta) * std::cos(phi), b * std::sin(theta) * std::sin(phi),
                                  c * std::cos(theta));
    }
  }
  const auto at = [&](int i, int k) { return static_cast<std::uint32_t>(i * columns + k % columns); };
  for (int i = 0; i < rows; ++i) {
    for (int k = 0; k < columns; ++k) {
      surface.triangles.push_back({at(i, k), at(i + 1, k), at(i + 1, k + 1)});
      surface.triangles.push_back({at(i, k), at(i + 1, k + 1), at(i, k + 1)});
    }
  }
  return surface;
}

}  // namespace

TEST(SurfaceDistance, IsZeroOnItselfAndTheGapBetweenConcentricSpheres) {
  const Surface inner = ellipsoid(0.02, 0.02, 0.02), outer = ellipsoid(0.025, 0.025, 0.025);
  EXPECT_LT(vest::tools::meanDistance(inner, inner), 0.0003);
  EXPECT_NEAR(vest::tools::meanDistance(inner, outer), 0.005, 0.0003);
  EXPECT_NEAR(vest::tools::meanDistance(outer, inner), 0.005, 0.0003);
}

TEST(SurfaceDistance, SamplesAreSpreadByAreaNotByTriangles) {
  Surface two;  // a large triangle and, beside it, one of a hundredth of its area
  two.points = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {5, 0, 0}, {5.1, 0, 0}, {5, 0.1, 0}};
  two.triangles = {{0, 1, 2}, {3, 4, 5}};
  int small = 0;
  const auto samples = vest::tools::sampleEvenly(two, 1010);
  for (const auto& p : samples) small += p.x() > 4;
  EXPECT_NEAR(small, 10, 2);
  EXPECT_NEAR(static_cast<double>(samples.size()), 1010, 2);
}

TEST(SurfaceDistance, TheRigidFitUndoesAShiftAndATurn) {
  const Surface still = ellipsoid(0.03, 0.02, 0.012);
  Surface moving = still;
  const Eigen::Isometry3d truth =
      Eigen::Translation3d(0.1, -0.05, 0.02) * Eigen::AngleAxisd(0.3, Eigen::Vector3d(1, 2, -1).normalized());
  for (auto& p : moving.points) p = truth * p;
  const Eigen::Isometry3d fit = vest::tools::rigidFit(moving, still);
  for (auto& p : moving.points) p = fit * p;
  EXPECT_LT(vest::tools::meanDistance(moving, still), 0.0006);
}
