// Protects: a broken sensor, a hole in the data, a foot that nobody sees any more. All on an injected clock.
#include <gtest/gtest.h>

#include <cmath>

#include "vest_hw_phantom_box/driver/driver.h"

namespace {

using namespace vest;
using driver::BoxState;
using driver::kMillisecond;
using driver::Nanoseconds;
using protocol::kJoints;

/// A box that sends a frame a millisecond into a driver.
struct Bench {
  explicit Bench(int instruments = 3) : d(calibration::defaultCalibration()) {
    d.connected(now);
    protocol::Hello h;
    h.instruments = static_cast<std::uint8_t>(instruments);
    d.hello(h, now);
    m.instruments = h.instruments;
    m.counts.fill(500);
  }
  bool send() {
    const bool fresh = d.motion(m, now);
    pass();
    return fresh;
  }
  void send(int n) {
    for (int i = 0; i < n; ++i) send();
  }
  void pass(int ms = 1) {
    now += ms * kMillisecond;
    m.time_us += 1000u * static_cast<unsigned>(ms);
  }
  Nanoseconds now = 1000 * kMillisecond;
  protocol::Motion m;
  driver::Driver d;
};

std::vector<std::pair<int, int>> events(driver::Footswitches& f) {
  std::array<driver::PedalEvent, 4 * protocol::kFootswitches> e;
  const int n = f.take(e);
  std::vector<std::pair<int, int>> out;
  for (int i = 0; i < n; ++i) out.emplace_back(e[i].pedal, e[i].value);
  return out;
}

TEST(Driver, RunsOnceReadingsHaveSettled) {
  Bench b;
  EXPECT_EQ(BoxState::kSettling, b.d.state(b.now)) << "it has said who it is, and nothing else";
  b.send(20);
  EXPECT_EQ(BoxState::kSettling, b.d.state(b.now)) << "nothing is believed before it settled";
  b.send(1);
  EXPECT_EQ(BoxState::kRunning, b.d.state(b.now));
  for (int i = 0; i < kJoints; ++i) {
    EXPECT_TRUE(b.d.usable(i));
    EXPECT_DOUBLE_EQ(calibration::defaultCalibration().joints[i].position(500),
                     b.d.sample().joints[i].position);
  }
}

TEST(Driver, ABoxWithTwoInstrumentsHasNoThird) {
  Bench b(2);
  for (int i = 10; i < 15; ++i) b.m.counts[i] = protocol::kNoReading;  // and misses none
  b.send(30);
  EXPECT_EQ(BoxState::kRunning, b.d.state(b.now));
  for (int i = 10; i < 15; ++i) EXPECT_FALSE(b.d.has(i));
  EXPECT_TRUE(b.d.has(9));
  EXPECT_TRUE(b.d.has(15));
}

TEST(Driver, TheLightPostIsThereWhereBoxAndCalibrationHaveIt) {
  for (const bool box : {false, true})
    for (const bool file : {false, true}) {
      auto c = calibration::defaultCalibration();
      c.has_light_post = file;
      driver::Driver d(c);
      d.connected(0);
      EXPECT_FALSE(d.has(protocol::kLightPost)) << "nobody has said so yet";
      EXPECT_FALSE(d.has(0));
      protocol::Hello h;
      h.light_post = box;
      d.hello(h, 0);
      EXPECT_EQ(box && file, d.has(protocol::kLightPost));
    }
}

TEST(Driver, ABoxThatIsGoneIsDisconnectedAndNotOneThatSaysNothing) {
  Bench b;
  b.send(30);
  b.d.disconnected(b.now);
  EXPECT_EQ(BoxState::kDisconnected, b.d.state(b.now));
}

TEST(Driver, AHandIsFollowedThroughTheWrapOfTheBoxsClock) {
  Bench b;
  b.m.time_us = 0xFFFFFFFFu - 40000u;
  b.send(30);
  const auto epoch = b.d.epoch();
  for (int i = 0; i < 100; ++i) {
    b.m.counts[0] = static_cast<std::int16_t>(b.m.counts[0] + 50);
    b.send();
    ASSERT_DOUBLE_EQ(calibration::defaultCalibration().joints[0].position(b.m.counts[0]),
                     b.d.sample().joints[0].position)
        << i;
  }
  EXPECT_EQ(epoch, b.d.epoch());
  EXPECT_EQ(0u, b.d.counters().rejected + b.d.counters().faults);
}

TEST(Driver, AMotionFrameThatDoesNotFitTheHelloIsIgnored) {
  Bench b;
  b.send(30);
  b.m.instruments = 2;
  EXPECT_FALSE(b.send());
  EXPECT_EQ(1u, b.d.counters().mismatched);
}

TEST(Driver, NothingIsUsedBeforeHelloOrOfAnotherVersion) {
  driver::Driver d(calibration::defaultCalibration());
  d.connected(0);
  protocol::Motion m;
  EXPECT_FALSE(d.motion(m, 0));
  EXPECT_EQ(BoxState::kNoHello, d.state(0));
  protocol::Hello h;
  h.version_major = 2;
  d.hello(h, 0);
  EXPECT_FALSE(d.motion(m, 0));
  EXPECT_EQ(BoxState::kIncompatible, d.state(0));
}

/// What can be wrong with one reading.
enum class Break { kFlag, kNoReading, kJumpUp, kJumpDown };

void damage(protocol::Motion& m, int joint, Break how) {
  switch (how) {
    case Break::kFlag:
      m.invalid |= 1u << joint;
      break;
    case Break::kNoReading:
      m.counts[joint] = protocol::kNoReading;
      break;
    case Break::kJumpUp:
      m.counts[joint] = 30000;
      break;
    case Break::kJumpDown:
      m.counts[joint] = -30000;
      break;
  }
}

class EveryBreak : public ::testing::TestWithParam<Break> {};
INSTANTIATE_TEST_SUITE_P(Driver, EveryBreak,
                         ::testing::Values(Break::kFlag, Break::kNoReading, Break::kJumpUp,
                                           Break::kJumpDown));

TEST_P(EveryBreak, OneBadReadingInAnyJointIsHeldAndForgotten) {
  for (int joint = 0; joint < kJoints; ++joint) {
    Bench b;
    b.send(30);
    const double before = b.d.sample().joints[joint].position;
    const auto good = b.m;
    damage(b.m, joint, GetParam());
    EXPECT_TRUE(b.send());
    EXPECT_EQ(before, b.d.sample().joints[joint].position) << joint;
    EXPECT_EQ(0, b.d.sample().joints[joint].velocity);
    EXPECT_TRUE(b.d.usable(joint)) << joint;
    EXPECT_EQ(1u, b.d.counters().rejected);
    b.m.counts = good.counts;
    b.m.invalid = 0;
    b.send();
    EXPECT_TRUE(b.d.usable(joint));
    EXPECT_EQ(before, b.d.sample().joints[joint].position);
    EXPECT_EQ(0u, b.d.counters().faults);
  }
}

TEST_P(EveryBreak, AfterTenMillisecondsOfHoldingTheJointIsInFault) {
  for (int joint = 0; joint < kJoints; ++joint) {
    Bench b;
    b.send(30);
    damage(b.m, joint, GetParam());
    for (int ms = 1; ms <= 10; ++ms) {
      b.send();
      ASSERT_TRUE(b.d.usable(joint)) << joint << " at " << ms;
    }
    b.send();
    EXPECT_FALSE(b.d.usable(joint)) << joint;
    EXPECT_EQ(BoxState::kFault, b.d.state(b.now));
    EXPECT_EQ(1u, b.d.counters().faults);
    for (int other = 0; other < kJoints; ++other) {
      if (other == joint) continue;
      EXPECT_TRUE(b.d.usable(other)) << other;
    }
  }
}

TEST(Driver, TheCountForNoReadingIsNoPositionEvenNextToOne) {
  for (int joint = 0; joint < kJoints; ++joint) {
    Bench b;
    b.m.counts[joint] = -32767;
    b.send(30);
    ASSERT_TRUE(b.d.usable(joint));
    b.m.counts[joint] = protocol::kNoReading;  // one count away: no jump
    b.send(12);
    EXPECT_FALSE(b.d.usable(joint)) << joint;
  }
}

TEST(Driver, APositionThatIsNotFiniteNeverComesOut) {
  for (const double broken : {std::nan(""), HUGE_VAL, -HUGE_VAL})
    for (int joint = 0; joint < kJoints; ++joint) {
      auto c = calibration::defaultCalibration();
      c.joints[joint].zero_count = broken;
      driver::Driver d(c);
      d.connected(0);
      d.hello(protocol::Hello{}, 0);
      protocol::Motion m;
      for (int i = 0; i < 100; ++i) {
        m.time_us += 1000;
        d.motion(m, i * kMillisecond);
        ASSERT_FALSE(d.usable(joint)) << joint;
        ASSERT_TRUE(std::isfinite(d.sample().joints[joint].position));
        ASSERT_EQ(i >= 20, d.usable((joint + 1) % kJoints)) << i;
      }
    }
}

TEST(Driver, AFaultedJointComesBackAfterSettlingAndClaimsNoSpeed) {
  Bench b;
  b.send(30);
  b.m.invalid = 1;
  b.send(500);
  EXPECT_FALSE(b.d.usable(0));
  b.m.invalid = 0;
  b.m.counts[0] = 9000;  // the hand moved meanwhile
  b.send(20);
  EXPECT_FALSE(b.d.usable(0));
  b.send(1);
  EXPECT_TRUE(b.d.usable(0));
  EXPECT_DOUBLE_EQ(0.9, b.d.sample().joints[0].position);
  EXPECT_EQ(0, b.d.sample().joints[0].velocity);
}

TEST(Driver, ReadingsThatAreFlaggedDoNotSettleTheJoint) {
  Bench b;
  b.send(30);
  b.m.invalid = 1;
  b.send(500);  // the same count all the time, and no measurement
  b.m.invalid = 0;
  b.send(20);
  EXPECT_FALSE(b.d.usable(0));
  b.send(1);
  EXPECT_TRUE(b.d.usable(0));
}

TEST(Driver, ASensorThatNeverSettlesNeverComesBack) {
  Bench b;
  b.send(30);
  for (int i = 0; i < 300; ++i) {
    b.m.counts[3] = static_cast<std::int16_t>(i % 2 ? 20000 : -20000);
    b.send();
    if (i > 12) {
      ASSERT_FALSE(b.d.usable(3)) << i;
      ASSERT_EQ(BoxState::kFault, b.d.state(b.now)) << i;
    }
  }
}

TEST(Driver, AFastHandIsNoJump) {
  Bench b;
  b.send(30);
  for (int i = 0; i < 300; ++i) {
    // 20 rad/s, well below the 50 of the calibration.
    b.m.counts[0] = static_cast<std::int16_t>(b.m.counts[0] + (i < 50 ? 200 : i < 100 ? -200 : 0));
    b.send();
    ASSERT_TRUE(b.d.usable(0)) << i;
    if (i == 49) {
      EXPECT_NEAR(20, b.d.sample().joints[0].velocity, 0.1);
    }
  }
  EXPECT_EQ(0u, b.d.counters().rejected);
  EXPECT_NEAR(0, b.d.sample().joints[0].velocity, 1e-3);
}

TEST(Driver, LostFramesGiveNoSamplesAndAShortHoleNoFault) {
  Bench b;
  b.send(30);
  b.pass(8);
  b.m.counts[0] = static_cast<std::int16_t>(b.m.counts[0] + 900);  // 0.09 rad in 9 ms: possible
  EXPECT_TRUE(b.send());
  EXPECT_TRUE(b.d.usable(0));
  EXPECT_EQ(0u, b.d.counters().faults + b.d.counters().rejected);
}

TEST(Driver, AfterAHoleLongerThanTheHoldJointsSettleAnew) {
  Bench b;
  b.send(30);
  b.m.invalid = 1;  // a reading that was rejected long ago is no fault of today
  b.send(1);
  b.m.invalid = 0;
  b.send(30);
  b.pass(15);
  b.send(1);
  for (int i = 0; i < kJoints; ++i) EXPECT_FALSE(b.d.usable(i)) << i;
  EXPECT_EQ(BoxState::kSettling, b.d.state(b.now)) << "no sensor is to blame";
  b.send(20);
  EXPECT_EQ(BoxState::kRunning, b.d.state(b.now));
  for (int i = 0; i < kJoints; ++i) EXPECT_TRUE(b.d.usable(i)) << i;
}

TEST(Driver, WithoutFramesItIsStaleWithinTwentyMilliseconds) {
  Bench b;
  b.send(30);
  const Nanoseconds last = b.now - kMillisecond;
  EXPECT_EQ(BoxState::kRunning, b.d.state(last + 20 * kMillisecond));
  EXPECT_EQ(BoxState::kStale, b.d.state(last + 20 * kMillisecond + 1));
}

TEST(Driver, PositionsStayWithinTheCalibratedLimits) {
  Bench b;
  b.m.counts[0] = 12500;  // 1.25 rad, limit 1.2
  b.send(30);
  EXPECT_EQ(1.2, b.d.sample().joints[0].position);
  EXPECT_GT(b.d.counters().clamped, 0u);
}

TEST(Driver, AShaftTurnsRoundAndRoundWhereItsSixteenBitsHoldOneTurn) {
  constexpr int kRoll = 3;
  const calibration::Joint roll = calibration::defaultCalibration().joints[kRoll];
  for (const double way : {1.0, -1.0}) {
    Bench b;
    b.m.counts[kRoll] = 0;
    b.send(30);
    double turned = 0;
    for (int i = 0; i < 2000; ++i) {  // 30 rad in 2 s
      turned += way * 0.015;
      b.m.counts[kRoll] = roll.count(turned);
      ASSERT_NE(protocol::kNoReading, b.m.counts[kRoll]);
      if (i % 500 == 499) {  // a broken reading half a turn away, and a flagged one
        const auto good = b.m;
        b.m.counts[kRoll] = static_cast<std::int16_t>(good.counts[kRoll] ^ 0x4000);
        b.send();
        b.m.counts = good.counts;
      }
      b.send();
      ASSERT_TRUE(b.d.usable(kRoll)) << turned;
      ASSERT_NEAR(turned, b.d.sample().joints[kRoll].position, 1.01e-4);
      ASSERT_NEAR(way * 15.0, b.d.sample().joints[kRoll].velocity, i < 50 ? 15.0 : 4.0);
    }
    // After a fault the turns are still known.
    b.m.invalid = 1u << kRoll;
    b.send(20);
    ASSERT_FALSE(b.d.usable(kRoll));
    b.m.invalid = 0;
    b.send(30);
    EXPECT_NEAR(turned, b.d.sample().joints[kRoll].position, 1.01e-4);
  }
}

TEST(Driver, ABoxWithoutReferenceOrWithInternalErrorGivesNoJoints) {
  for (const std::uint8_t status : {protocol::kNotReferenced, protocol::kInternalError}) {
    Bench b;
    b.m.status = status;
    b.send(100);
    for (int i = 0; i < kJoints; ++i) EXPECT_FALSE(b.d.usable(i));
    EXPECT_EQ(BoxState::kFault, b.d.state(b.now));
  }
}

TEST(Driver, ABoxThatRestartsBeginsANewEpoch) {
  Bench b;
  b.send(30);
  const auto before = b.d.epoch();
  b.m.time_us = 5;
  b.send();
  EXPECT_GT(b.d.epoch(), before);
  EXPECT_FALSE(b.d.usable(0));
  b.send(30);
  ASSERT_TRUE(b.d.usable(0));
  protocol::Hello start;
  start.instruments = b.m.instruments;
  start.start = true;
  b.d.hello(start, b.now);
  EXPECT_FALSE(b.d.usable(0)) << "it says so itself, its clock may have gone on";
}

TEST(Footswitches, AllSixtyFourMasksArriveAfterTenMilliseconds) {
  for (int from = 0; from < 64; ++from)
    for (int to = 0; to < 64; ++to) {
      Bench b;
      b.m.footswitches = static_cast<std::uint8_t>(from);
      b.send(12);
      ASSERT_EQ(from, b.d.footswitches().pressed());
      b.m.footswitches = static_cast<std::uint8_t>(to);
      b.send(10);
      ASSERT_EQ(from, b.d.footswitches().pressed()) << "before the debounce time";
      b.send(1);
      ASSERT_EQ(to, b.d.footswitches().pressed());
    }
}

TEST(Footswitches, ChatterShorterThanTheDebounceTimeIsNeverSeen) {
  for (int period = 1; period <= 9; ++period) {
    Bench b;
    for (int i = 0; i < 400; ++i) {
      b.m.footswitches = (i / period) % 2 ? 0x3F : 0;
      b.send();
      ASSERT_EQ(0, b.d.footswitches().pressed()) << period;
    }
    EXPECT_TRUE(events(b.d.footswitches()).empty());
  }
}

TEST(Footswitches, OlderThanAHundredMillisecondsCountsAsReleased) {
  for (int mask = 1; mask < 64; ++mask) {
    Bench b;
    b.m.footswitches = static_cast<std::uint8_t>(mask);
    b.send(300);
    events(b.d.footswitches());
    const Nanoseconds last = b.now - kMillisecond;
    b.d.tick(last + 100 * kMillisecond);
    ASSERT_EQ(mask, b.d.footswitches().pressed());
    b.d.tick(last + 100 * kMillisecond + 1);
    ASSERT_EQ(0, b.d.footswitches().pressed());
    for (const auto& e : events(b.d.footswitches())) {
      EXPECT_EQ(0, e.second) << "a loss is no tap";
      EXPECT_TRUE(mask >> e.first & 1) << "only what was down is let go";
    }
    // Back, still pressed: counts again only after a full debounce time.
    b.pass(500);
    b.send(10);
    ASSERT_EQ(0, b.d.footswitches().pressed());
    b.send(1);
    ASSERT_EQ(mask, b.d.footswitches().pressed());
  }
}

TEST(Footswitches, UnpluggedPedalsAndALostPortReleaseTheSameWay) {
  Bench b;
  b.m.footswitches = 1;
  b.send(50);
  b.m.status = protocol::kPedalsMissing;
  b.send(102);
  EXPECT_EQ(0, b.d.footswitches().pressed());
  Bench c;
  c.m.footswitches = 1;
  c.send(50);
  c.d.disconnected(c.now);
  EXPECT_EQ(1, c.d.footswitches().pressed());
  c.d.tick(c.now + 101 * kMillisecond);
  EXPECT_EQ(0, c.d.footswitches().pressed());
}

TEST(Footswitches, AHoleInTheDataStartsTheDebounceTimeAnew) {
  Bench b;
  b.send(12);
  b.m.footswitches = 4;
  b.send(2);
  b.pass(50);
  b.send(10);
  EXPECT_EQ(0, b.d.footswitches().pressed());
  b.send(1);
  EXPECT_EQ(4, b.d.footswitches().pressed());
}

TEST(Footswitches, AQuickTapIsPressedThenTwoThenReleased) {
  Bench b;
  b.m.footswitches = 8;
  b.send(60);
  b.m.footswitches = 0;
  b.send(12);
  EXPECT_EQ((std::vector<std::pair<int, int>>{{3, 1}, {3, 2}, {3, 0}}), events(b.d.footswitches()));
  b.m.footswitches = 8;
  b.send(400);
  b.m.footswitches = 0;
  b.send(12);
  EXPECT_EQ((std::vector<std::pair<int, int>>{{3, 1}, {3, 0}}), events(b.d.footswitches()));
}

TEST(Footswitches, APedalThatStaysDownForAMinuteIsReportedAsStuck) {
  Bench b;
  b.m.footswitches = 2;
  b.send(59000);
  EXPECT_EQ(0, b.d.footswitches().stuck(b.now));
  b.send(1100);
  EXPECT_EQ(2, b.d.footswitches().stuck(b.now));
  b.m.footswitches = 0;
  b.send(12);
  EXPECT_EQ(0, b.d.footswitches().stuck(b.now));
}

}  // namespace
