#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "vest_tissue/solver/random.h"

namespace {

using namespace vest::solver;

TEST(Random, TheFinaliserIsThatOfSplitMix64) {
  // First outputs of SplitMix64 from 1234567, as published with its description.
  const std::uint64_t expected[] = {6457827717110365317ULL, 3203168211198807973ULL, 9817491932198370423ULL,
                                    4593380528125082431ULL, 16408922859458223821ULL};
  std::uint64_t state = 1234567;
  for (const std::uint64_t value : expected) EXPECT_EQ(mix64(state += kGoldenGamma), value);
}

TEST(Random, IsAFunctionOfSeedStepAndIndexAlone) {
  EXPECT_EQ(randomBits(1, 2, 3), randomBits(1, 2, 3));
  std::set<std::uint64_t> all;
  for (std::uint32_t seed = 0; seed < 8; ++seed) {
    for (std::uint64_t step = 0; step < 32; ++step) {
      for (std::uint64_t index = 0; index < 32; ++index) all.insert(randomBits(seed, step, index));
    }
  }
  EXPECT_EQ(all.size(), 8u * 32u * 32u);
}

TEST(Random, IsUniformAndItsNeighboursAreUncorrelated) {
  const int n = 20000;
  double mean = 0, square = 0, along_index = 0, along_step = 0, along_seed = 0;
  int eighths[8] = {};
  for (int i = 0; i < n; ++i) {
    const std::uint64_t step = 1 + i / 100, index = i % 100;
    const double x = randomUniform(1, step, index);
    ASSERT_GE(x, 0.0);
    ASSERT_LT(x, 1.0);
    mean += x / n, square += x * x / n;
    along_index += (x - 0.5) * (randomUniform(1, step, index + 1) - 0.5) * 12 / n;
    along_step += (x - 0.5) * (randomUniform(1, step + 1, index) - 0.5) * 12 / n;
    along_seed += (x - 0.5) * (randomUniform(2, step, index) - 0.5) * 12 / n;
    ++eighths[randomBelow(8, 1, step, index)];
  }
  // Five standard deviations of an ideal generator.
  EXPECT_NEAR(mean, 0.5, 5 * 0.289 / std::sqrt(n));
  EXPECT_NEAR(square, 1.0 / 3, 5 * 0.298 / std::sqrt(n));
  for (const double r : {along_index, along_step, along_seed}) EXPECT_NEAR(r, 0.0, 5 / std::sqrt(n));
  for (const int count : eighths) EXPECT_NEAR(count, n / 8.0, 5 * std::sqrt(n * 7 / 64.0));
}

}  // namespace
