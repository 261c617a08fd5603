#include <gtest/gtest.h>

#include <cmath>

#include <nlohmann/json.hpp>

#include "vest_bringup/session/statistics.h"

// Protects session.json: its fields, and that it does not flatter.

namespace vest::session {
namespace {

TEST(StepStatistics, ASteadySessionIsRealTime) {
  StepStatistics s;
  for (int k = 1; k <= 5000; ++k) s.add(static_cast<std::uint64_t>(k), 0.001, 100.0 + 0.001 * k, false);
  EXPECT_NEAR(s.realTimeFactor(), 1.0, 1e-9);
  EXPECT_NEAR(s.worstSecond(), 1.0, 0.011);
  EXPECT_EQ(s.skipped(), 0U);
}

TEST(StepStatistics, APauseOf300MillisecondsShowsInTheWorstSecondOnly) {
  StepStatistics s;
  double t = 0;
  for (int k = 1; k <= 10000; ++k) {
    t += k == 5000 ? 0.3 : 0.001;
    s.add(static_cast<std::uint64_t>(k), 0.001, t, false);
  }
  EXPECT_NEAR(s.realTimeFactor(), 10.0 / 10.3, 0.001);
  EXPECT_NEAR(s.worstSecond(), 0.7, 0.02);
}

TEST(StepStatistics, MissingStepsAreCountedAndACommandBeginsAnew) {
  StepStatistics s;
  s.add(1, 0.001, 0.001, false);
  s.add(2, 0.001, 0.002, false);
  s.add(5, 0.001, 0.005, false);
  EXPECT_EQ(s.skipped(), 2U);
  s.add(1, 0.001, 0.006, true);
  s.add(2, 0.001, 0.007, false);
  EXPECT_EQ(s.skipped(), 2U);
  EXPECT_EQ(s.steps(), 5U);
}

TEST(Summary, SessionJsonHasTheFieldsThatOthersReadAndStaysJsonWithoutAnyStep) {
  Summary summary;
  summary.version = "0.1.0";
  summary.state_hash = "00ff";
  summary.topics["/vest/joint_states"].add(1.0);
  summary.topics["/vest/joint_states"].add(1.5);
  summary.events.push_back({7, 0.007, "grasped", "right", "tube_right", std::nan("")});
  summary.clock_jumps.push_back({9, 0.0125, -3600.0});
  const auto j = nlohmann::json::parse(toJson(summary));
  for (const char* field :
       {"real_time_factor", "steps", "rates", "events", "scene_hash", "state_hash", "version"}) {
    EXPECT_TRUE(j.contains(field)) << field;
  }
  EXPECT_TRUE(j["real_time_factor"].is_null());
  EXPECT_EQ(j["rates"]["/vest/joint_states"], 2.0);
  EXPECT_TRUE(j["events"][0]["force_n"].is_null());
  EXPECT_EQ(j["clock_jumps"][0]["step"], 9);
  EXPECT_EQ(j["clock_jumps"][0]["by_s"], -3600.0);
}

}  // namespace
}  // namespace vest::session
