#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "vest_instruments/control/instrument.h"
#include "vest_instruments/control/pedals.h"
#include "vest_instruments/kinematics/jacobian.h"
#include "vest_instruments/ros/told_lately.h"
#include "vest_instruments/tools/tool_geometry.h"

namespace {

using namespace vest::control;
using vest::tools::ToolKind;

class Control : public ::testing::Test {
 protected:
  vest::kinematics::TrainerBox box =
      vest::kinematics::loadTrainerBox(std::string(VEST_INSTRUMENTS_DIR) + "/config/trainer_box.yaml");
  Instrument left(Source source) const { return Instrument(box.arms[0], source); }
  static Joints joints(double a, double b, double c, double d, double e) {
    return (Joints() << a, b, c, d, e).finished();
  }
};

TEST_F(Control, OnlyTheSelectedSourceMovesTheInstrument) {
  Instrument i = left(Source::Box);
  EXPECT_EQ(i.servoJoints(joints(0.3, 0, 0.1, 0, 0), false, 1.0), Verdict::OtherSource);
  EXPECT_EQ(i.servoPose(Source::Crtk, i.tip(), 1.0), Verdict::OtherSource);
  EXPECT_EQ(i.moveJoints(joints(0.3, 0, 0.1, 0, 0), false, 1.0), Verdict::OtherSource);
  i.update(1.0);
  EXPECT_EQ(i.measured()[0], 0.0);
  EXPECT_FALSE(i.valid());
  EXPECT_EQ(i.sensedJoints(Source::Box, joints(0.3, 0.1, 0.15, 1, 0.5), true, nullptr, 1.0), Verdict::Taken);
  i.update(1.0);
  EXPECT_TRUE(i.valid());
  EXPECT_EQ(i.measured()[0], 0.3);
}

TEST_F(Control, SilenceOf100MillisecondsHoldsThePoseAndSaysSo) {
  Instrument i = left(Source::Box);
  i.sensedJoints(Source::Box, joints(0.3, 0.1, 0.15, 1, 0.5), true, nullptr, 1.0);
  i.update(1.09);
  EXPECT_TRUE(i.valid());
  i.update(1.11);
  EXPECT_FALSE(i.valid());
  EXPECT_EQ(i.measured()[0], 0.3);
  EXPECT_TRUE(i.velocity().isZero());
}

TEST_F(Control, NotANumberIsRefusedAndThePoseStays) {
  Instrument i = left(Source::Box);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  i.sensedJoints(Source::Box, joints(0.3, 0.1, 0.15, 1, 0.5), true, nullptr, 1.0);
  EXPECT_EQ(i.sensedJoints(Source::Box, joints(nan, 0.1, 0.15, 1, 0.5), true, nullptr, 1.01),
            Verdict::NotFinite);
  EXPECT_EQ(i.sensedJoints(Source::Box, joints(0.1, 0.1, 0.15, 1, nan), true, nullptr, 1.01),
            Verdict::NotFinite);
  i.update(1.01);
  EXPECT_EQ(i.measured()[0], 0.3);
}

TEST_F(Control, LimitsHoldAndTheCommandBeyondShowsAsADifferenceToTheSetpoint) {
  Instrument i = left(Source::Crtk);
  EXPECT_EQ(i.servoJoints(joints(9, -9, 9, 900, 9), true, 1.0), Verdict::Limited);
  i.update(1.0);
  EXPECT_EQ(i.setpoint()[0], 1.2);
  EXPECT_EQ(i.setpoint()[1], -1.2);
  EXPECT_EQ(i.setpoint()[2], 0.28);
  EXPECT_EQ(i.setpoint()[4], vest::tools::toolGeometry(ToolKind::Grasper).max_jaw_angle);
  Eigen::Isometry3d X = i.arm().X_BTrocar;
  X.translation() = X * Eigen::Vector3d(0, 0, 0.5);
  EXPECT_EQ(i.servoPose(Source::Crtk, X, 1.1), Verdict::Limited);
  EXPECT_NEAR((i.setpointTip().translation() - X.translation()).norm(), 0.5 - 0.28, 1e-9);
  EXPECT_EQ(i.servoJaw(Source::Crtk, 9, 1.2), Verdict::Limited);
  EXPECT_EQ(i.servoJoints(i.setpoint(), true, 1.3), Verdict::Taken) << "what was read can be sent back";
}

TEST_F(Control, AMoveIsBusyUntilItArrivesAndHoldStopsIt) {
  Instrument i = left(Source::Crtk);
  const auto before = i.stateRevision();
  EXPECT_EQ(i.moveJoints(joints(0.4, 0, 0.1, 0, 0), false, 1.0), Verdict::Taken);
  EXPECT_TRUE(i.busy());
  EXPECT_NE(i.stateRevision(), before);
  double last = 0.0;
  for (double t = 1.0; t < 3.0; t += 0.001) {
    i.update(t);
    EXPECT_GE(i.measured()[0], last);
    EXPECT_LE(i.velocity()[0], 1.05 * Instrument::kMoveSpeed);
    last = i.measured()[0];
  }
  EXPECT_FALSE(i.busy());
  EXPECT_DOUBLE_EQ(i.measured()[0], 0.4);
  i.moveJoints(joints(0.0, 0, 0.1, 0, 0), false, 3.0);
  i.update(3.2);
  EXPECT_EQ(i.hold(3.2), Verdict::Taken);
  EXPECT_FALSE(i.busy());
  const double held = i.measured()[0];
  EXPECT_GT(held, 0.0);
  i.update(5.0);
  EXPECT_EQ(i.measured()[0], held);
  EXPECT_TRUE(i.valid()) << "a simulated arm stays valid where its client left it";
}

TEST_F(Control, AMoveThatCannotArriveIsRefusedAndTheArmStays) {
  Instrument i = left(Source::Crtk);
  EXPECT_EQ(i.moveJoints(joints(2, 0, 0.1, 0, 0), false, 1.0), Verdict::OutOfReach);
  EXPECT_EQ(i.moveJaw(3.0, 1.0), Verdict::OutOfReach);
  Eigen::Isometry3d X = i.arm().X_BTrocar;
  X.translation() = X * Eigen::Vector3d(0, 0, 0.5);
  EXPECT_EQ(i.movePose(X, 1.0), Verdict::OutOfReach);
  EXPECT_FALSE(i.busy());
  const Joints before = i.setpoint();
  i.update(2.0);
  EXPECT_EQ(i.setpoint(), before);
}

TEST_F(Control, ArmAndJawMoveBesideEachOtherAndEachIsBusy) {
  Instrument i = left(Source::Crtk);
  EXPECT_EQ(i.moveJoints(joints(0.4, 0, 0.1, 0, 0), false, 1.0), Verdict::Taken);
  i.update(1.1);
  EXPECT_EQ(i.moveJaw(0.8, 1.1), Verdict::Taken);
  for (double t = 1.1; t < 4.0; t += 0.001) i.update(t);
  EXPECT_FALSE(i.busy());
  EXPECT_DOUBLE_EQ(i.setpoint()[0], 0.4) << "the jaw's move did not stop the arm's";
  EXPECT_DOUBLE_EQ(i.setpoint()[4], 0.8);
  const auto before = i.stateRevision();
  EXPECT_EQ(i.moveJaw(0.8, 5.0), Verdict::Taken);
  EXPECT_TRUE(i.busy()) << "a client waits for busy, be the way ever so short";
  i.update(5.0);
  EXPECT_FALSE(i.busy());
  EXPECT_EQ(i.stateRevision(), before + 2);
  i.moveJaw(0.0, 6.0);
  i.servoJoints(joints(0.1, 0, 0.1, 0, 0), false, 6.1);
  EXPECT_TRUE(i.busy()) << "a servo of the arm leaves the jaw's move alone";
  i.servoJaw(Source::Crtk, 0.3, 6.2);
  EXPECT_FALSE(i.busy());
}

TEST_F(Control, AFreeArmGivesWayToTheTissueAndAHeldOneDoesNot) {
  Instrument i = left(Source::Crtk);
  i.servoJoints(joints(0.1, 0.1, 0.15, 0.5, 0.2), true, 1.0);
  i.update(1.0);
  const Eigen::Vector3d start = i.tip().translation(), along = i.tip().linear().col(2);
  Eigen::Matrix<double, 6, 1> push = Eigen::Matrix<double, 6, 1>::Zero();
  push.head<3>() = -along;  // 1 N out through the trocar
  const auto press = [&](double from, double until) {
    for (double t = from; t < until; t += 0.001) {
      i.feel(push, t);
      i.update(t);
    }
  };
  press(1.0, 1.5);
  EXPECT_EQ(i.tip().translation(), start) << "held";
  EXPECT_EQ(i.release(1.5), Verdict::Taken);
  EXPECT_TRUE(i.free());
  press(1.5, 2.0);
  EXPECT_NEAR((i.tip().translation() - start).dot(along), -0.5 * Instrument::kYield, 1e-4);
  push.head<3>() = i.tip().linear().col(0);  // sideways, about the pivot
  const Eigen::Vector3d there = i.tip().translation();
  press(2.0, 2.1);
  EXPECT_NEAR((i.tip().translation() - there).dot(push.head<3>()), 0.1 * Instrument::kYield, 1e-4);
  const Eigen::Vector3d after = i.tip().translation();
  i.update(2.15);
  const Eigen::Vector3d gone = i.tip().translation();
  for (double t = 2.5; t < 3.0; t += 0.001) i.update(t);
  EXPECT_LT((i.tip().translation() - gone).norm(), 1e-12) << "a force that nobody tells of moves nothing";
  EXPECT_LT((gone - after).norm(), 0.002);
  EXPECT_EQ(i.hold(3.0), Verdict::Taken);
  press(3.0, 3.2);
  EXPECT_LT((i.tip().translation() - gone).norm(), 1e-12) << "held again";
}

TEST_F(Control, ASimulatedArmIsSomewhereBeforeItsFirstCommand) {
  Instrument i = left(Source::Crtk);
  i.update(1.0);
  EXPECT_TRUE(i.valid());
  EXPECT_TRUE(i.stateCommand("pause", 1.0));
  i.update(1.1);
  EXPECT_FALSE(i.valid());
  EXPECT_TRUE(i.known()) << "paused, but where it was";
  Instrument box = left(Source::Box);
  box.update(1.0);
  EXPECT_FALSE(box.known());
}

// An angled optic whose shaft pointed at the aim showed the bowel before the pelvis, not the uterus.
TEST_F(Control, AnInstrumentBeginsTowardsItsAimAndAnOpticOfAnyAngleShowsIt) {
  EXPECT_EQ(left(Source::None).measured(), joints(0, 0, 0.1, 0, 0));
  for (const double angle : {0.0, 0.5235987755983, 0.7853981633974, 1.2}) {
    auto arm = box.arm(vest::tools::Instrument::Endoscope);
    arm.optic_angle = angle;
    const Instrument endoscope(arm, Source::None);
    const Eigen::Isometry3d X_BOptical = endoscope.tip() * vest::kinematics::opticalFrame(angle, 0.0);
    const Eigen::Vector3d seen = X_BOptical.inverse() * arm.aim_B;
    EXPECT_GT(seen.z(), 0.05) << angle;
    EXPECT_LT(seen.head<2>().norm(), 1e-9) << angle;
    EXPECT_DOUBLE_EQ((endoscope.tip().translation() - arm.pivot_B).norm(), 0.1) << angle;
  }
}

TEST_F(Control, AShaftTurnsRoundAsOftenAsOneLikes) {
  Instrument i = left(Source::Crtk);
  Eigen::Isometry3d X = i.tip();
  double last = i.setpoint()[3];
  for (int k = 0; k < 200; ++k) {
    X.linear() = X.linear() * Eigen::AngleAxisd(0.1, Eigen::Vector3d::UnitZ()).toRotationMatrix();
    EXPECT_EQ(i.servoPose(Source::Crtk, X, 1.0 + 0.01 * k), Verdict::Taken);
    EXPECT_NEAR(i.setpoint()[3] - last, 0.1, 1e-9) << "neither stops nor jumps, step " << k;
    last = i.setpoint()[3];
  }
}

TEST_F(Control, StateCommandsFollowCrtkAndWrongOnesAreRefused) {
  Instrument i = left(Source::Crtk);
  EXPECT_EQ(i.operatingState(), OperatingState::Enabled);
  EXPECT_TRUE(i.stateCommand("pause", 1));
  EXPECT_EQ(i.operatingState(), OperatingState::Paused);
  EXPECT_EQ(i.servoJoints(joints(0.1, 0, 0.1, 0, 0), false, 1), Verdict::NotEnabled);
  EXPECT_FALSE(i.stateCommand("pause", 1));
  EXPECT_FALSE(i.stateCommand("home", 1));
  EXPECT_TRUE(i.stateCommand("resume", 1));
  EXPECT_TRUE(i.stateCommand("unhome", 1));
  EXPECT_EQ(i.servoJoints(joints(0.1, 0, 0.1, 0, 0), false, 1), Verdict::NotHomed);
  EXPECT_TRUE(i.stateCommand("home", 1));
  EXPECT_TRUE(i.stateCommand("disable", 1));
  EXPECT_FALSE(i.stateCommand("resume", 1));
  EXPECT_TRUE(i.stateCommand("enable", 1));
  EXPECT_EQ(i.servoJoints(joints(0.1, 0, 0.1, 0, 0), false, 1), Verdict::Taken);
  EXPECT_FALSE(i.stateCommand("explode", 1));
  EXPECT_TRUE(i.stateCommand("source:box", 1));
  EXPECT_EQ(i.source(), Source::Box);
  EXPECT_FALSE(i.stateCommand("source:ghost", 1));
}

TEST_F(Control, AChangeOfSourceKeepsThePose) {
  Instrument i = left(Source::Box);
  i.sensedJoints(Source::Box, joints(0.3, 0.1, 0.15, 1, 0.5), true, nullptr, 1.0);
  i.update(1.0);
  i.selectSource(Source::Replay, 1.1);
  i.update(1.1);
  EXPECT_EQ(i.measured(), joints(0.3, 0.1, 0.15, 1, 0.5));
  EXPECT_FALSE(i.valid()) << "until the new source speaks";
}

TEST_F(Control, TheClutchLetsAHandMoveAwayWithoutTheInstrument) {
  Instrument i = left(Source::Teleop);
  Eigen::Isometry3d hand = i.tip();
  i.servoPose(Source::Teleop, hand, 1.0);
  const Eigen::Vector3d start = i.setpointTip().translation();
  i.setClutch(true);
  hand.translation().x() += 0.05;
  EXPECT_EQ(i.servoPose(Source::Teleop, hand, 1.1), Verdict::Clutched);
  i.update(1.1);
  EXPECT_LT((i.tip().translation() - start).norm(), 1e-9);
  EXPECT_TRUE(i.valid());
  i.setClutch(false);
  i.servoPose(Source::Teleop, hand, 1.2);
  EXPECT_LT((i.setpointTip().translation() - start).norm(), 1e-9) << "no jump on release";
  hand.translation().x() += 0.01;
  i.servoPose(Source::Teleop, hand, 1.3);
  EXPECT_NEAR(i.setpointTip().translation().x(), start.x() + 0.01, 1e-9);
}

TEST_F(Control, AClipFiresWhenTheHandleClosesAfterHavingBeenOpen) {
  Instrument i = left(Source::Box);
  ASSERT_TRUE(i.exchangeTool(ToolKind::ClipApplier));
  const auto handle = [&](double angle, double t) {
    i.sensedJoints(Source::Box, joints(0, 0, 0.1, 0, angle), true, nullptr, t);
    i.update(t);
    return i.fires();
  };
  EXPECT_FALSE(handle(0.0, 1.0)) << "closed from the start is no shot";
  EXPECT_FALSE(handle(0.4, 1.1));
  EXPECT_TRUE(handle(0.01, 1.2));
  EXPECT_FALSE(i.exchangeTool(ToolKind::Endoscope));
  ASSERT_TRUE(i.exchangeTool(ToolKind::Grasper));
  handle(0.4, 1.3);
  EXPECT_FALSE(handle(0.01, 1.4)) << "a grasper fires nothing";
  Instrument scope(box.arms[3], Source::Box);
  EXPECT_FALSE(scope.exchangeTool(ToolKind::Grasper));
}

TEST(PedalsTest, EveryMaskSwitchesWhatTheToolTakesAndAgeReleasesAll) {
  using F = PedalFunction;
  for (std::uint32_t mask = 0; mask < 64; ++mask) {
    Pedals p({F::Coagulate, F::Cut, F::Irrigate, F::Suck, F::NextTool, F::Clutch});
    EXPECT_EQ(p.active(ToolKind::CoagulationHook, 0.0), 0u);
    p.update(0, 9.9);
    p.update(mask, 10.0);
    const std::uint32_t clutch = (mask & 32) ? 32u : 0u;
    EXPECT_EQ(p.active(ToolKind::CoagulationHook, 10.05),
              ((mask & 1) ? 2u : 0u) | ((mask & 2) ? 1u : 0u) | clutch);
    EXPECT_EQ(p.active(ToolKind::SuctionIrrigator, 10.05),
              ((mask & 4) ? 4u : 0u) | ((mask & 8) ? 8u : 0u) | clutch);
    EXPECT_EQ(p.active(ToolKind::Grasper, 10.05), clutch);
    EXPECT_EQ(p.active(ToolKind::Endoscope, 10.05), (mask & 4) ? 4u : 0u) << "rinses the lens";
    EXPECT_EQ(p.active(ToolKind::CoagulationHook, 10.11), 0u) << "older than 100 ms counts as released";
    EXPECT_EQ(p.takeToolPress(), (mask & 16) != 0 ? kEveryInstrument : 0u);
    EXPECT_FALSE(p.takeToolPress());
    p.update(mask, 10.05);
    EXPECT_FALSE(p.takeToolPress()) << "held is not pressed again";
  }
}

TEST(PedalsTest, AGapInTheMessagesReleasesButOnePressStaysOnePress) {
  using F = PedalFunction;
  Pedals p({F::Coagulate, F::None, F::None, F::None, F::NextTool, F::None});
  p.update(16, 0.0);
  EXPECT_FALSE(p.takeToolPress()) << "down since before it was heard: nobody saw it up";
  p.update(0, 0.1);
  p.update(16 | 1, 0.2);
  EXPECT_TRUE(p.takeToolPress());
  EXPECT_EQ(p.active(ToolKind::CoagulationHook, 5.0), 0u) << "silence switches off";
  p.update(16 | 1, 5.0);
  EXPECT_FALSE(p.takeToolPress()) << "a busy machine held the messages up, the foot did not move";
  EXPECT_NE(p.active(ToolKind::CoagulationHook, 5.0), 0u);
  p.update(0, 9.0);
  p.update(16, 14.0);
  EXPECT_TRUE(p.takeToolPress()) << "seen up, then down: a press, however late";
  p.update(0, 14.1);
  p.forget();
  EXPECT_EQ(p.active(ToolKind::CoagulationHook, 14.1), 0u);
  p.update(16, 14.2);
  EXPECT_FALSE(p.takeToolPress()) << "what it did while nobody listened is not known";
}

TEST(PedalsTest, EachPresetNamesSixPedalsAndEachDoesForEachToolWhatItsNameSays) {
  struct Expected {
    const char* preset;
    const char* pedal;
    std::uint32_t hook, forceps, irrigator, endoscope;
  };
  using namespace vest::tools;
  const Expected expected[] = {
      {"trainer", "coag", kFunctionCoagulate, kFunctionCoagulate, 0, 0},
      {"trainer", "cut", kFunctionCut, 0, 0, 0},
      {"trainer", "irrigation", 0, 0, kFunctionIrrigate, kFunctionIrrigate},
      {"trainer", "suction", 0, 0, kFunctionSuck, 0},
      {"trainer", "tool", 0, 0, 0, 0},
      {"trainer", "clutch", kFunctionClutch, kFunctionClutch, kFunctionClutch, 0},
      {"dvrk", "clutch", kFunctionClutch, kFunctionClutch, kFunctionClutch, 0},
      {"dvrk", "camera", 0, 0, 0, kFunctionCameraFollow},
      {"dvrk", "cam_minus", 0, 0, 0, kFunctionCameraOut},
      {"dvrk", "cam_plus", 0, 0, 0, kFunctionCameraIn},
      {"dvrk", "bicoag", 0, kFunctionCoagulate, 0, 0},
      {"dvrk", "coag", kFunctionCoagulate, 0, 0, 0},
  };
  for (std::size_t n = 0; n < std::size(expected); ++n) {
    const Expected& e = expected[n];
    const auto preset = footswitchPreset(e.preset);
    ASSERT_TRUE(preset);
    EXPECT_EQ(preset->names[n % 6], e.pedal) << "bit " << n % 6 << " of the box";
    Pedals p(preset->functions);
    p.update(1u << (n % 6), 1.0);
    EXPECT_EQ(p.active(ToolKind::CoagulationHook, 1.0), e.hook) << e.preset << " " << e.pedal;
    EXPECT_EQ(p.active(ToolKind::BipolarForceps, 1.0), e.forceps) << e.preset << " " << e.pedal;
    EXPECT_EQ(p.active(ToolKind::SuctionIrrigator, 1.0), e.irrigator) << e.preset << " " << e.pedal;
    EXPECT_EQ(p.active(ToolKind::Endoscope, 1.0), e.endoscope) << e.preset << " " << e.pedal;
  }
  EXPECT_FALSE(footswitchPreset("piano"));
}

// Jaws that hold tissue hang it up; a handle that closes does not: each grasp would.
TEST(PedalsTest, SuspendReachesWhatHasJawsAndNoHandleGivesIt) {
  EXPECT_EQ(vest::control::pedalFunctionFromName("suspend"), PedalFunction::Suspend);
  Pedals p({{0, PedalFunction::Suspend, vest::control::kEveryInstrument}});
  p.update(1, 1.0);
  for (int i = 0; i < vest::tools::kToolKindCount; ++i) {
    const auto kind = static_cast<ToolKind>(i);
    const bool jaws =
        kind == ToolKind::Grasper || kind == ToolKind::BipolarForceps || kind == ToolKind::NeedleHolder;
    EXPECT_EQ(p.active(kind, 1.0), jaws ? vest::tools::kFunctionSuspend : 0u) << vest::tools::toolName(kind);
    EXPECT_TRUE(!jaws || (vest::control::functionsOf(kind) & vest::tools::kFunctionFire) == 0u);
  }
}

TEST(PedalsTest, ASwitchActsOnItsOwnInstrumentsAlone) {
  using vest::tools::Instrument;
  Pedals p({{3, PedalFunction::Coagulate, maskOf(Instrument::Left)},
            {3, PedalFunction::Clutch, maskOf(Instrument::Right)},
            {31, PedalFunction::NextTool, maskOf(Instrument::Third)}});
  p.update(0, 0.9);
  p.update(1u << 3 | 1u << 31, 1.0);
  EXPECT_EQ(p.active(ToolKind::CoagulationHook, 1.0, maskOf(Instrument::Left)), 2u);
  EXPECT_EQ(p.active(ToolKind::CoagulationHook, 1.0, maskOf(Instrument::Right)), 32u);
  EXPECT_EQ(p.takeToolPress(), maskOf(Instrument::Third));
}

}  // namespace

TEST(ToldLately, ASentenceComesAgainAfterTwoSecondsAndEverOtherOnesAreBounded) {
  vest::ros_shell::ToldLately lately;
  EXPECT_FALSE(lately("servo_jp: 3 values", 0.0));
  EXPECT_TRUE(lately("servo_jp: 4 values", 1.9)) << "its numbers do not count";
  EXPECT_FALSE(lately("servo_jp: 4 values", 2.1));
  int told = 0;
  for (std::size_t i = 0; i < 1000; ++i) told += lately(std::string(i, 'x'), 2.2) ? 0 : 1;
  EXPECT_EQ(told, 63) << "of 64 in two seconds, with the one before";
  EXPECT_FALSE(lately("something else", 5.0)) << "a flood that has ended silences nobody";
}
