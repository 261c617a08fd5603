// Protects the hand from whatever arithmetic may come up with. The oracle looks at bits, not at comparisons.
#include <cmath>
#include <cstring>
#include <random>

#include <gtest/gtest.h>

#include "support.h"

using namespace vest::haptics;

namespace {

std::uint64_t bitsOf(double x) {
  std::uint64_t b;
  std::memcpy(&b, &x, sizeof b);
  return b;
}
double fromBits(std::uint64_t b) {
  double x;
  std::memcpy(&x, &b, sizeof x);
  return x;
}
bool finiteBits(double x) {
  return ((bitsOf(x) >> 52) & 0x7ff) != 0x7ff;
}

LimiterOptions cartesian() {
  LimiterOptions o;
  o.maximum = {3.3, 0, 0, 0, 0};
  o.slew_per_tick = {0.165, 0, 0, 0, 0};
  return o;
}
LimiterOptions joints() {
  LimiterOptions o;
  o.joints = true;
  o.maximum = {0.4, 0.4, 3.3, 0.05, 0.2};
  for (int i = 0; i < kChannels; ++i) o.slew_per_tick[i] = 0.05 * o.maximum[i];
  return o;
}

double length(const Loads& x, const Loads& y) {
  return std::hypot(x[0] - y[0], x[1] - y[1], x[2] - y[2]);
}

/// Raw 64 bit patterns: NaNs with every payload, infinities, denormals, huge and ordinary numbers.
void fuzz(const LimiterOptions& o, std::uint64_t seed) {
  const auto count =
      static_cast<std::uint64_t>(vest::haptics::testing::counted(50000000, 500000, "inputs of raw bits"));
  std::mt19937_64 random(seed);
  Limiter limiter(o);
  Loads before{};
  std::uint64_t violations = 0, shown = 0;
  for (std::uint64_t n = 0; n < count; ++n) {
    Loads wanted;
    const std::uint64_t kind = random();
    for (double& x : wanted) {
      const std::uint64_t bits = random();
      // Mostly ordinary size, so that the state moves; else any bits.
      x = (kind & 7) ? fromBits((bits & 0x800fffffffffffffull) | (0x3f0ull + (bits >> 58)) << 52)
                     : fromBits(bits);
    }
    const double allowance = (kind & 0x700) ? 1.0 : fromBits(random());
    std::uint32_t flags = 0;
    const Loads out = limiter.limit(wanted, allowance, flags);
    bool input_finite = finiteBits(allowance) && allowance >= 0.0 && allowance <= 1.0;
    for (int i = 0; i < (o.joints ? kChannels : 3); ++i) input_finite &= finiteBits(wanted[i]);
    bool bad = false, zero = true;
    for (const double x : out) {
      bad |= !finiteBits(x);
      zero &= x == 0.0;
    }
    if (!input_finite) bad |= !zero || !(flags & kLimitNotFinite);
    const bool stop = !input_finite || allowance == 0.0;
    if (o.joints) {
      for (int i = 0; i < kChannels; ++i) {
        bad |= std::abs(out[i]) > o.maximum[i];
        bad |= !stop && std::abs(out[i] - before[i]) > o.slew_per_tick[i];
      }
    } else {
      bad |= length(out, Loads{}) > o.maximum[0];
      bad |= !stop && length(out, before) > o.slew_per_tick[0];
    }
    violations += bad;
    shown += !zero;
    before = out;
  }
  EXPECT_EQ(violations, 0u);
  EXPECT_GT(shown, count / 4) << "a limiter that shows nothing would pass everything else";
}

}  // namespace

TEST(Limiter, NoBitPatternGetsThroughOnACartesianDevice) {
  fuzz(cartesian(), 1);
}
TEST(Limiter, NoBitPatternGetsThroughOnAFiveAxisDevice) {
  fuzz(joints(), 2);
}

TEST(Limiter, WhatIsWithinLimitsPassesUnchanged) {
  Limiter limiter(cartesian());
  std::uint32_t flags = 0;
  const Loads wanted{0.1, -0.05, 0.08, 0, 0};
  EXPECT_EQ(limiter.limit(wanted, 1.0, flags), wanted);
  EXPECT_EQ(flags, 0u);
}

TEST(Limiter, DirectionIsKeptWhereTheMagnitudeIsCut) {
  for (const double size : {100.0, 1e300}) {  // squares of the second overflow
    Limiter limiter(cartesian());
    std::uint32_t flags = 0;
    Loads out{};
    for (int i = 0; i < 30; ++i) out = limiter.limit({3.0 * size, 4.0 * size, 0.0, 0, 0}, 1.0, flags);
    EXPECT_NEAR(out[0], 0.6 * 3.3, 1e-9) << size;
    EXPECT_NEAR(out[1], 0.8 * 3.3, 1e-9) << size;
    EXPECT_EQ(flags, std::uint32_t{kLimitMagnitude | kLimitSlew});
  }
}

TEST(Limiter, FromZeroToFullTakesTwentyTicksAndBackAsWell) {
  Limiter limiter(cartesian());
  std::uint32_t flags = 0;
  int up = 0;
  while (limiter.limit({3.3, 0, 0, 0, 0}, 1.0, flags)[0] < 3.29) ++up;
  EXPECT_EQ(up, 19);
  int down = 0;
  while (limiter.limit({0, 0, 0, 0, 0}, 1.0, flags)[0] > 0.01) ++down;
  EXPECT_EQ(down, 19);
}

TEST(Limiter, ZeroIsZeroAtOnceAndTheWayBackStartsThere) {
  Limiter limiter(cartesian());
  std::uint32_t flags = 0;
  for (int i = 0; i < 30; ++i) limiter.limit({3.3, 0, 0, 0, 0}, 1.0, flags);
  EXPECT_EQ(limiter.zero(), Loads{});
  EXPECT_LE(limiter.limit({3.3, 0, 0, 0, 0}, 1.0, flags)[0], 0.165);
  for (int i = 0; i < 30; ++i) limiter.limit({3.3, 0, 0, 0, 0}, 1.0, flags);
  EXPECT_EQ(limiter.limit({3.3, 0, 0, 0, 0}, 0.0, flags), Loads{}) << "no allowance, no force";
}

TEST(Limiter, TheAllowanceScalesWhatIsLeftOfTheMaximum) {
  Limiter limiter(cartesian());
  std::uint32_t flags = 0;
  Loads out{};
  for (int i = 0; i < 50; ++i) out = limiter.limit({100.0, 0, 0, 0, 0}, 0.25, flags);
  EXPECT_NEAR(out[0], 0.25 * 3.3, 1e-9);
}
