#include <gtest/gtest.h>

#include "vest_bringup/session/clock_watch.h"
#include "vest_bringup/session/script_end.h"

// Protects a recording from a system clock that is set: the jump is seen once, and times stay on one line.
// Protects a session's end from a clock that knows nothing of its script, and moments from old pictures.

namespace vest::session {
namespace {

constexpr double kStart = 1.8e9;  ///< s since 1970

TEST(ClockWatch, AClockThatIsDisciplinedDoesNotJumpHoweverFarItComes) {
  ClockWatch w;
  double offset = kStart;
  for (int i = 0; i < 200000; ++i) {
    const double steady = 0.02 * i;
    offset += 0.02 * 500e-6;  // the fastest that the kernel slews: adjtimex(2), 500 ppm
    EXPECT_FALSE(w.look(steady + offset, steady)) << i;
  }
  EXPECT_TRUE(w.jumps().empty());
  EXPECT_GT(offset - kStart, 1.9) << "it did come far";
  EXPECT_EQ(w.line(offset + 3999.98, 3999.99), offset + 3999.98);
}

TEST(ClockWatch, EachJumpIsSeenOnceAndByHowMuch) {
  ClockWatch w;
  EXPECT_FALSE(w.look(kStart, 10.0)) << "the first reading is no jump";
  EXPECT_FALSE(w.look(kStart + 0.02 + 0.09, 10.02)) << "below what is told from discipline";
  const auto back = w.look(kStart - 3600.0 + 0.04 + 0.09, 10.04);
  ASSERT_TRUE(back);
  EXPECT_NEAR(back->by, -3600.0, 1e-6);
  EXPECT_EQ(back->steady, 10.04);
  EXPECT_FALSE(w.look(kStart - 3600.0 + 0.06 + 0.09, 10.06));
  const auto forward = w.look(kStart + 0.08 + 0.09, 10.08);
  ASSERT_TRUE(forward);
  EXPECT_NEAR(forward->by, 3600.0, 1e-6);
  EXPECT_EQ(w.jumps().size(), 2U);
}

TEST(ClockWatch, StampsOfEitherSideOfAJumpComeOnOneLine) {
  for (const double by : {-3600.0, 3600.0, 0.2, -0.2}) {
    ClockWatch w;
    w.look(kStart, 0.0);
    w.look(kStart + 1.0 + by, 1.0);
    // Taken 15 ms before the jump was seen and read 5 ms after it; taken after it; taken by a process whose
    // stamps do not follow.
    EXPECT_NEAR(w.line(kStart + 0.99, 1.005), kStart + 0.99, 1e-6) << by;
    EXPECT_NEAR(w.line(kStart + by + 2.0, 2.0), kStart + 2.0, 1e-6) << by;
    EXPECT_NEAR(w.line(kStart + 3.0, 3.0), kStart + 3.0, 1e-6) << by;
    w.look(kStart + 4.0 + 2 * by, 4.0);
    EXPECT_NEAR(w.line(kStart + 2 * by + 5.0, 5.0), kStart + 5.0, 1e-6) << by << ", twice";
    EXPECT_NEAR(w.line(kStart + by + 3.99, 4.0), kStart + 3.99, 1e-6) << by << ", before the second";
  }
}

TEST(ClockWatch, WithoutAJumpATimeIsReturnedBitForBit) {
  ClockWatch w;
  w.look(kStart, 0.0);
  for (const double t : {0.0, 1.0, kStart + 0.123456789}) EXPECT_EQ(w.line(t, 0.2), t);
}

TEST(ClockWatch, BothClocksAreReadAtOneMoment) {
  const auto a = readClocks();
  ASSERT_TRUE(a);
  const double steady = steadySeconds();
  EXPECT_LE(a->steady, steady);
  EXPECT_GT(a->system, 1.6e9) << "s since 1970";
}

TEST(ScriptEnd, IsNotBeforeTheScriptsHoweverLongTheSimulationRuns) {
  ScriptEnd end;
  EXPECT_FALSE(end.over(1e6));
  end.exerciseEnded(30.0);
  EXPECT_FALSE(end.over(1e6)) << "passed, and the hands still move";
  end.scriptEnded(50.0);
  EXPECT_FALSE(end.over(50.5)) << "what has happened is on its way";
  EXPECT_TRUE(end.over(50.0 + ScriptEnd::kTail));
}

TEST(ScriptEnd, AnExerciseMayGoOnBehindItButNotForEver) {
  ScriptEnd end;
  end.scriptEnded(50.0);
  EXPECT_FALSE(end.over(54.9));
  end.exerciseEnded(54.9);
  EXPECT_FALSE(end.over(55.5));
  EXPECT_TRUE(end.over(56.0));
  ScriptEnd never;
  never.scriptEnded(50.0);
  EXPECT_TRUE(never.over(50.0 + ScriptEnd::kPatience));
}

TEST(PictureMoment, IsKeptByAPictureOfItsOwnTimeAlone) {
  const PictureMoment m(kStart);
  EXPECT_EQ(m.look(kStart - 0.1, kStart - 0.2), PictureMoment::Answer::Wait) << "still to come";
  EXPECT_EQ(m.look(kStart + 0.2, kStart + 0.1), PictureMoment::Answer::Keep);
  // The view is starved: what it drew before is no picture of it, however often it is looked at.
  EXPECT_EQ(m.look(kStart + 1.0, kStart - 0.2), PictureMoment::Answer::Wait);
  EXPECT_EQ(m.look(kStart + 2.1, kStart - 0.2), PictureMoment::Answer::Missed);
  EXPECT_EQ(m.look(kStart + 1.0, kStart + 0.9), PictureMoment::Answer::Missed) << "that shows something else";
}

}  // namespace
}  // namespace vest::session
