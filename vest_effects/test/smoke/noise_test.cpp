#include <gtest/gtest.h>

#include <cmath>

#include "vest_effects/smoke/noise.h"

// Protects the noise against the published reference, and its periodic form against seams.

namespace vest::smoke {
namespace {

TEST(Noise, HasTheValueOfThePublishedProgram) {
  // Value of the reference program at this point, as several ports print it.
  EXPECT_EQ(noise(3.14, 42, 7), 0.13691995878400012);
}

TEST(Noise, IsZeroOnTheLatticeAndBoundedBetween) {
  double most = 0;
  for (int k = 0; k < 20000; ++k) {
    const double x = 0.37 * k, y = 0.11 * k - 300, z = 0.73 * k;
    most = std::max(most, std::fabs(noise(x, y, z)));
    EXPECT_EQ(noise(k % 300 - 100, k % 17, -(k % 5)), 0.0);
  }
  EXPECT_LT(most, 1.05);
  EXPECT_GT(most, 0.5);
}

TEST(Noise, ItsPeriodicFormHasNoSeamAndIsTheReferenceAt256) {
  for (int k = 0; k < 500; ++k) {
    const double x = 0.317 * k, y = 0.77 * k, z = 0.131 * k;
    EXPECT_NEAR(periodicNoise(x, y, z, 8), periodicNoise(x + 8, y - 16, z + 64, 8), 1e-12);
    EXPECT_EQ(periodicNoise(x, y, z, 256), noise(x, y, z));
    EXPECT_NEAR(turbulence(x, y, z, 3, 8), turbulence(x + 8, y + 8, z - 8, 3, 8), 1e-12);
  }
}

TEST(Noise, ItsSlopeIsContinuousAcrossCells) {
  for (int k = 1; k < 40; ++k) {
    const double e = 1e-6, y = 0.3 + 0.1 * k, z = 0.7;
    const double left = (noise(k, y, z) - noise(k - e, y, z)) / e,
                 right = (noise(k + e, y, z) - noise(k, y, z)) / e;
    EXPECT_NEAR(left, right, 1e-4);
  }
}

}  // namespace
}  // namespace vest::smoke
