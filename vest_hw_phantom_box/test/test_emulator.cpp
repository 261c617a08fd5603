// Protects: the emulated trainee plays what the file says, shows drop-outs as such, and repeats itself
// exactly.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "vest_hw_phantom_box/emulator/emulator.h"
#include "vest_hw_phantom_box/emulator/script_clock.h"
#include "vest_hw_phantom_box/protocol/decoder.h"
#include "vest_instruments/kinematics/jacobian.h"
#include "vest_instruments/kinematics/trainer_box.h"

namespace {

using namespace vest;
using emulator::Trajectory;
using emulator::TrajectoryOptions;

TEST(Trajectory, IsLinearBetweenRowsAndHoldsAtTheEnd) {
  const auto t = Trajectory::parse("t_s,left_yaw,footswitches\n0,0,1\n0.2,0.4,2\n0.4,0,0\n", "x.csv");
  EXPECT_DOUBLE_EQ(0.2, t.at(0.1).joints[0]);
  EXPECT_DOUBLE_EQ(0.3, t.at(0.25).joints[0]);
  EXPECT_DOUBLE_EQ(0, t.at(99).joints[0]);
  EXPECT_DOUBLE_EQ(0, t.at(-1).joints[0]);
  EXPECT_EQ(1, t.at(0.19).footswitches);
  EXPECT_EQ(2, t.at(0.2).footswitches);
  EXPECT_EQ(0, t.at(9).footswitches);
  EXPECT_EQ(emulator::restPose().joints[17], t.at(0.1).joints[17]) << "missing columns stay at rest";
}

// Without a script the picture showed the bowel before the pelvis.
TEST(Trajectory, AtRestAThirtyDegreeOpticShowsTheMiddleOfTheField) {
  const auto arm = kinematics::loadTrainerBox(TRAINER_BOX).arm(tools::Instrument::Endoscope);
  const auto q = emulator::restPose().joints;
  const int e = protocol::kEndoscope;
  const Eigen::Isometry3d tip =
      kinematics::forwardKinematics(arm.X_BTrocar, {q[e], q[e + 1], q[e + 2], q[e + 3], 0});
  const Eigen::Vector3d seen =
      (tip * kinematics::opticalFrame(arm.optic_angle, q[e + 4])).inverse() * arm.aim_B;
  EXPECT_GT(seen.z(), 0.05);
  EXPECT_LT(seen.head<2>().norm(), 0.002);
}

TEST(Trajectory, StartsAtItsFirstRow) {
  const auto t = Trajectory::parse("t_s,left_yaw\n1700000000.0,0.1\n1700000000.1,0.2\n", "x.csv");
  EXPECT_NEAR(0.15, t.at(0.05).joints[0], 1e-6);
}

TEST(Trajectory, CubicPassesThroughRowsWithoutKinks) {
  TrajectoryOptions o;
  o.interpolation = emulator::Interpolation::kCubic;
  std::string csv = "t_s,left_yaw\n";
  for (int i = 0; i <= 20; ++i)
    csv += std::to_string(i * 0.1) + "," + std::to_string(std::sin(i * 0.1)) + "\n";
  const auto t = Trajectory::parse(csv, "x.csv", o);
  for (double s = 0.1; s < 1.9; s += 0.01) {
    EXPECT_NEAR(std::sin(s), t.at(s).joints[0], 2e-4) << s;
    EXPECT_NEAR((t.at(s + 1e-6).joints[0] - t.at(s).joints[0]) / 1e-6,
                (t.at(s).joints[0] - t.at(s - 1e-6).joints[0]) / 1e-6, 1e-3)
        << s;
  }
}

TEST(Trajectory, ADropOutIsInvalidAndNeverBridged) {
  for (auto mode : {emulator::Interpolation::kLinear, emulator::Interpolation::kCubic}) {
    TrajectoryOptions o;
    o.interpolation = mode;
    const auto t =
        Trajectory::parse("t_s,left_yaw,footswitches\n0,0,1\n0.5,0.5,1\n1.1,1,1\n1.2,1,1\n", "x.csv", o);
    ASSERT_EQ(1u, t.gaps().size());
    EXPECT_DOUBLE_EQ(0.5, t.gaps()[0].begin);
    EXPECT_DOUBLE_EQ(1.1, t.gaps()[0].end);
    EXPECT_EQ(0u, t.at(0.5).invalid);
    EXPECT_EQ(0xFFFFFu, t.at(0.501).invalid);
    EXPECT_EQ(0xFFFFFu, t.at(1.099).invalid);
    EXPECT_EQ(0.5, t.at(0.8).joints[0]) << "no motion in between";
    EXPECT_EQ(0, t.at(0.8).footswitches);
    EXPECT_EQ(0u, t.at(1.1).invalid);
    EXPECT_NEAR(0.25, t.at(0.25).joints[0], 1e-12);
  }
}

TEST(Trajectory, LoopsWithThePeriodOfItsRows) {
  TrajectoryOptions o;
  o.at_end = emulator::AtEnd::kLoop;
  const auto t = Trajectory::parse("t_s,left_yaw\n0,0\n0.1,0.1\n0.2,0.2\n0.3,0.05\n", "x.csv", o);
  EXPECT_NEAR(0.15, t.at(0.15 + 0.4 * 7).joints[0], 1e-9);
}

TEST(Trajectory, ALoopThatEndsElsewhereGoesBackAsCalmlyAsAHand) {
  TrajectoryOptions o;
  o.at_end = emulator::AtEnd::kLoop;
  const auto t = Trajectory::parse(
      "t_s,left_yaw,left_insertion,footswitches\n0,0,0.1,0\n0.1,1,0.1,8\n0.2,2,0.1,8\n0.3,3,0.1,8\n", "x.csv",
      o);
  const double period = 0.3 + 1.5 * 3;  // 3 rad, at most 1 rad/s
  double fastest = 0;
  for (double at = 0.301; at < period; at += 0.001) {
    fastest = std::max(fastest, std::abs(t.at(at).joints[0] - t.at(at - 0.001).joints[0]) / 0.001);
    EXPECT_EQ(0, t.at(at).footswitches);
    EXPECT_EQ(0u, t.at(at).invalid);
  }
  EXPECT_NEAR(1.0, fastest, 1e-3);
  EXPECT_NEAR(1.5, t.at(0.3 + 0.5 * 4.5).joints[0], 1e-9);
  EXPECT_NEAR(1.5, t.at(0.15 + 7 * period).joints[0], 1e-9);
  const auto slides = Trajectory::parse("t_s,left_insertion\n0,0.1\n0.1,0.15\n0.2,0.2\n", "x.csv", o);
  EXPECT_NEAR(0.15, slides.at(0.2 + 0.75).joints[2], 1e-9);  // 0.1 m, at most 0.1 m/s
}

void expectError(const std::string& csv, const std::vector<std::string>& parts) {
  try {
    Trajectory::parse(csv, "x.csv");
    ADD_FAILURE() << "accepted:\n" << csv;
  } catch (const emulator::Error& e) {
    const std::string what = e.what();
    EXPECT_EQ(0u, what.find("x.csv: line ")) << what;
    for (const auto& p : parts) EXPECT_NE(std::string::npos, what.find(p)) << what;
  }
}

TEST(Trajectory, BadFilesAreRefusedWithLineColumnAndValue) {
  expectError("", {"line 1"});
  expectError("t_s\n", {"line 2", "no rows"});
  expectError("left_yaw\n1\n", {"t_s"});
  expectError("t_s,left_nose\n0,1\n", {"left_nose"});
  expectError("t_s,left_yaw,left_yaw\n0,1,1\n", {"twice"});
  expectError("t_s,left_yaw\n0,1\n0.1\n", {"line 3", "1 cells", "2"});
  expectError("t_s,left_yaw\n0,nan\n", {"line 2", "left_yaw", "'nan'"});
  expectError("t_s,left_yaw\n0,\n", {"line 2", "left_yaw", "''"});
  expectError("t_s,left_yaw\n0,1e9\n", {"line 2", "left_yaw", "'1e9'"});
  expectError("t_s,left_yaw\n0,1x\n", {"'1x'"});
  expectError("t_s, left_yaw \n0, 0 1 \n", {"left_yaw", "'0 1'"});
  expectError("t_s,left_yaw\n0,1\n0,1\n", {"line 3", "t_s", "later"});
  expectError("t_s,footswitches\n0,64\n", {"footswitches", "'64'", "63"});
  expectError("t_s,footswitches\n0,1.5\n", {"footswitches", "'1.5'"});
  EXPECT_THROW(Trajectory::load("/nowhere.csv"), emulator::Error);
  EXPECT_THROW(Trajectory::load("/"), emulator::Error);
}

protocol::Bytes play(std::uint64_t seed) {
  emulator::Faults f;
  f.drop = f.flip = f.split = f.garbage = f.lose = f.jump = f.invalid = f.chatter = 0.1;
  f.seed = seed;
  emulator::Emulator e(calibration::defaultCalibration(), 3, f);
  protocol::Bytes line;
  for (int i = 0; i < 3000; ++i) e.tick(emulator::defaultMotion(i * 1e-3), line);
  return line;
}

TEST(Emulator, TheSameSeedGivesTheSameBytes) {
  EXPECT_EQ(play(4), play(4));
  EXPECT_NE(play(4), play(5));
}

TEST(Emulator, SkippedFramesShowAsLostOnTheWire) {
  struct Sink : protocol::FrameSink {
    void onHello(const protocol::Hello&, std::uint32_t) override {}
    void onMotion(const protocol::Motion& m) override { last = m; }
    protocol::Motion last;
  } sink;
  emulator::Emulator e(calibration::defaultCalibration(), 2);
  protocol::Bytes line;
  for (int i = 0; i < 10; ++i) e.tick(emulator::defaultMotion(0), line);
  e.skip(50);
  e.tick(emulator::defaultMotion(0), line);
  protocol::Decoder d;
  d.feed(line.data(), line.size(), sink);
  EXPECT_EQ(50u, d.counters().lost);
  EXPECT_EQ(60000u, sink.last.time_us);
}

/// A script beside a simulation whose speed is given: seconds by the script's clock and by the simulation,
/// and by how much the script was ahead at most.
struct Beside {
  double script = 0, simulated = 0, lead = 0;
};
template <class Speed>
Beside beside(double seconds, Speed speed, bool told = true) {
  emulator::ScriptClock clock;
  Beside b;
  clock.at(100.0);
  for (int k = 1; k <= std::lround(1000 * seconds); ++k) {
    const double t = 0.001 * k;
    b.simulated += 0.001 * speed(t);
    if (told && k % 5 == 0) clock.hear(7.0 + b.simulated);
    b.script = clock.at(100.0 + t);
    b.lead = std::max(b.lead, b.script - b.simulated);
  }
  return b;
}

TEST(ScriptClock, IsRealTimeWhereTheSimulationIsOrSaysNothing) {
  EXPECT_NEAR(beside(20, [](double) { return 1.0; }).script, 20.0, 1e-9);
  EXPECT_NEAR(beside(
                  20, [](double) { return 0.5; }, false)
                  .script,
              20.0, 1e-9);
  EXPECT_NEAR(beside(20, [](double t) { return 1.0 + 0.3 * std::sin(60.0 * t); }).script, 20.0, 0.05)
      << "steps come in heaps";
}

TEST(ScriptClock, IsNeverFurtherThanTheSimulationAndItsLead) {
  constexpr double kAhead = emulator::ScriptClock::kLead + 0.01;  // and what is not told yet
  for (const double speed : {0.3, 0.7, 0.9}) {
    const Beside b = beside(60, [speed](double) { return speed; });
    EXPECT_NEAR(b.script, 60 * speed, kAhead) << speed;
    EXPECT_LT(b.lead, kAhead);
  }
  // Single seconds at half speed, as on a busy machine.
  const Beside b = beside(40, [](double t) { return std::fmod(t, 2.0) < 1.0 ? 0.5 : 1.0; });
  EXPECT_NEAR(b.script, 30.0, kAhead);
  EXPECT_LT(b.lead, kAhead);
}

TEST(ScriptClock, StandsWithASimulationThatPausesAndIsAsFastAsHandsAtMost) {
  EXPECT_NEAR(beside(30, [](double t) { return t > 10 && t < 20 ? 0.0 : 1.0; }).script, 20.0, 0.06);
  EXPECT_NEAR(beside(30, [](double t) { return t > 10 && t < 20 ? 3.0 : 1.0; }).script, 30.0, 1e-9);
  // It catches up what it lost: hands do not; at half speed again they are slow again.
  const auto speed = [](double t) { return t < 10 ? 0.5 : t < 15 ? 2.0 : 0.5; };
  EXPECT_NEAR(beside(25, speed).script, 5.0 + 5.0 + 5.0 + emulator::ScriptClock::kBehind, 0.12);
}

TEST(ScriptClock, LosesNothingWhereTheSimulationStandsAndCatchesUpInBursts) {
  // As a runner does beside load: it stands for 0.1 s, makes 0.05 s good at once, and goes on.
  for (const int burst : {3, 11}) {
    const auto speed = [&](double t) {
      const long ms = std::lround(1000 * t) % 300;
      return ms < 100 ? 0.0 : ms < 100 + 50 / (burst - 1) ? burst : 1.0;
    };
    const Beside b = beside(60, speed);
    EXPECT_NEAR(b.simulated, 50.0, 0.06);
    EXPECT_GT(b.script, b.simulated - 0.1) << burst;
    EXPECT_LT(b.lead, emulator::ScriptClock::kLead + 0.01) << burst;
  }
}

TEST(ScriptClock, LosesNothingWhereItsEmulatorIsLetRunInHeaps) {
  // It hears of all at once, and then sends what it owes.
  emulator::ScriptClock clock;
  double script = clock.at(0.0);
  for (int heap = 1; heap <= 1000; ++heap) {
    clock.hear(0.045 * heap);
    for (int k = 1; k <= 45; ++k) script = clock.at(0.045 * (heap - 1) + 0.001 * k);
  }
  EXPECT_NEAR(script, 45.0, 0.05);
}

TEST(ScriptClock, NeverLeaps) {
  // 90 ms without a tick, and ticks that were lost: the simulation went on, hands move by what they may.
  emulator::ScriptClock clock;
  double script = clock.at(0.0);
  clock.hear(0.0);
  for (const double away : {0.09, 1.0}) {
    const double before = script;
    clock.hear(1.0 + away);
    for (int k = 1; k <= 90; ++k) script = clock.at(away + 0.001 * k);
    EXPECT_NEAR(script, before + emulator::ScriptClock::kLead, 1e-9) << away;
  }
}

TEST(ScriptClock, GoesOnWhereAnotherSceneBeginsAtZero) {
  emulator::ScriptClock clock;
  clock.at(0.0);
  for (int k = 1; k <= 4000; ++k) {
    clock.hear(k < 2000 ? 0.001 * k : 0.001 * (k - 2000));
    EXPECT_NEAR(clock.at(0.001 * k), 0.001 * k, 1e-9);
  }
}

}  // namespace
