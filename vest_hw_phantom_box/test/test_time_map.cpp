// Protects stamps: never back, never ahead, without the jitter of the line, whatever the clocks do.
#include <gtest/gtest.h>

#include <cmath>

#include "vest_hw_phantom_box/driver/footswitches.h"
#include "vest_hw_phantom_box/driver/time_map.h"

namespace {

using namespace vest;
using driver::kMillisecond;

constexpr std::int64_t kWall = 1700000000LL * 1000000000LL;

TEST(TimeMap, LateArrivalDoesNotShowInTheStamps) {
  driver::TimeMap map;
  std::int64_t last = 0;
  // Every 13th frame is prompt; in between the offset may creep up by the allowed drift, and returns at once.
  const double kDriftAllowance = 13 * driver::TimeMap::kDrift * kMillisecond + 100;
  for (int i = 0; i < 5000; ++i) {
    const std::int64_t late = (i * 7919) % 13 * 100000;  // up to 1.2 ms
    const std::int64_t steady = i * kMillisecond + late;
    const std::int64_t stamp = map.stamp(static_cast<std::uint32_t>(i) * 1000u, steady, kWall + steady);
    if (i > 100) {
      EXPECT_NEAR(static_cast<double>(kMillisecond), static_cast<double>(stamp - last), kDriftAllowance);
    }
    EXPECT_LE(stamp, kWall + steady) << "never in the future";
    last = stamp;
  }
}

TEST(TimeMap, DeviceTimeMayWrap) {
  driver::TimeMap map;
  std::int64_t last = 0;
  for (int i = 0; i < 100; ++i) {
    // Every other frame is late, the one at the wrap (51) too: a new start there would show.
    const std::int64_t steady = i * kMillisecond + (i % 2) * 300000;
    const std::int64_t s =
        map.stamp(0xFFFFFFFFu - 50000u + static_cast<std::uint32_t>(i) * 1000u, steady, kWall + steady);
    if (i > 0) {
      EXPECT_NEAR(static_cast<double>(kMillisecond), static_cast<double>(s - last), 1000) << i;
    }
    EXPECT_EQ((0xFFFFFFFFll - 50000 + i * 1000) * 1000, map.device()) << "extended beyond 32 bit";
    last = s;
  }
}

TEST(TimeMap, StampsNeverGoBackWhenTheWallClockOrTheBoxDoes) {
  driver::TimeMap map;
  std::int64_t last = INT64_MIN;
  for (int i = 0; i < 20000; ++i) {
    const std::int64_t steady = i * kMillisecond;
    std::int64_t wall = kWall + steady;
    if (i > 5000) wall -= 3600LL * 1000 * kMillisecond;  // set back by an hour
    if (i == 10000) map.reset();
    const std::uint32_t device = static_cast<std::uint32_t>(i % 10000) * 1000u;
    const std::int64_t s = map.stamp(device, steady, wall);
    ASSERT_GT(s, last) << i;
    last = s;
  }
  EXPECT_LT(map.wallStep(), -3500LL * 1000 * kMillisecond);
}

TEST(TimeMap, AClockThatIsSetForwardIsFollowedAtOnceAndTheFirstStampIsTheWallClocks) {
  driver::TimeMap map;
  const std::int64_t hour = 3600LL * 1000 * kMillisecond;
  // The wall clock may even lie behind the steady one, on a machine without a battery.
  EXPECT_EQ(5000 * kMillisecond, map.stamp(0, 10000 * kMillisecond, 5000 * kMillisecond));
  EXPECT_EQ(hour + 5001 * kMillisecond, map.stamp(1000, 10001 * kMillisecond, hour + 5001 * kMillisecond));
}

TEST(TimeMap, FramesThatArriveTogetherStillGetStampsThatGrow) {
  driver::TimeMap map;
  std::int64_t last = INT64_MIN;
  for (int i = 0; i < 10; ++i) {
    const std::int64_t s =
        map.stamp(static_cast<std::uint32_t>(i) * 1000u, 50 * kMillisecond, kWall + 50 * kMillisecond);
    EXPECT_GT(s, last);
    last = s;
  }
}

TEST(TimeMap, ADeviceClockThatStoodStillIsSetAnew) {
  driver::TimeMap map;
  map.stamp(0, 0, kWall);
  const std::int64_t now = 5000 * kMillisecond;
  EXPECT_NEAR(static_cast<double>(now), static_cast<double>(map.stamp(1000, now, kWall + now) - kWall), 3e6);
}

TEST(TimeMap, AQuartzThatIsOffIsFollowed) {
  for (const double ppm : {-100e-6, 100e-6}) {
    driver::TimeMap map;
    double worst = 0;
    for (int i = 0; i < 100000; ++i) {
      const std::int64_t steady = i * kMillisecond;
      const auto device = static_cast<std::uint32_t>(std::llround(i * 1000.0 * (1 + ppm)));
      const std::int64_t s = map.stamp(device, steady, kWall + steady);
      worst = std::max(worst, std::abs(static_cast<double>(s - kWall - steady)));
    }
    EXPECT_LT(worst, 20000) << "20 µs after 100 s, where the quartz alone is 10 ms off";
  }
}

TEST(TimeMap, ABoxWithoutAQuartzIsFollowedToo) {
  for (const double slow : {0.01, -0.01, 0.5, -1.0}) {  // the last two: half the rate that it says, and twice
    driver::TimeMap map;
    std::int64_t last = INT64_MIN;
    double worst = 0;
    for (int i = 0; i < 100000; ++i) {
      // A line that hands frames over in lumps of 16 ms, as USB converters do.
      const std::int64_t steady = (i / 16 + 1) * 16 * kMillisecond;
      const auto device = static_cast<std::uint32_t>(std::llround(i * 1000.0 * (1 - slow)));
      const std::int64_t s = map.stamp(device, steady, kWall + steady);
      ASSERT_GT(s, last);
      ASSERT_LE(s, kWall + steady + 16000) << "a frame that came with others has a stamp after theirs";
      last = s;
      worst = std::max(worst, static_cast<double>(kWall + steady - s));
    }
    EXPECT_LT(worst, (std::abs(slow) * 1.02 + 0.032) * 1e9) << slow;
  }
}

}  // namespace
