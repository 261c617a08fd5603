#include <cmath>
#include <cstdio>
#include <fstream>
#include <sstream>
#include <string>

#include <gtest/gtest.h>

#include "vest_instruments/trajectory/trajectory.h"

namespace {

using namespace vest::trajectory;
using vest::tools::Instrument;

class TrajectoryTest : public ::testing::Test {
 protected:
  vest::kinematics::TrainerBox box =
      vest::kinematics::loadTrainerBox(std::string(VEST_INSTRUMENTS_DIR) + "/config/trainer_box.yaml");
  std::string path = ::testing::TempDir() + "/vest_trajectory_test_" +
                     ::testing::UnitTest::GetInstance()->current_test_info()->name();
  void write(const std::string& text) { std::ofstream(path) << text; }
  void TearDown() override { std::remove(path.c_str()); }

  std::string refusal(const std::string& text, bool motion) {
    write(text);
    try {
      motion ? (void)fromMotion(path, box, Instrument::Left, 0.3) : (void)fromWaypoints(path, box);
    } catch (const TrajectoryError& e) {
      EXPECT_NE(std::string(e.what()).find(path), std::string::npos) << e.what();
      return e.what();
    }
    return "";
  }
};

/// A hand that circles for 1 s, is lost for 2 s, and circles on; 50 samples a second, wider than the box
/// allows.
std::string circleWithGap() {
  std::ostringstream out;
  out << "t_s,px_mm,py_mm,pz_mm,qx,qy,qz,qw,extra\n";
  for (int i = 0; i < 100; ++i) {
    const double t = 5.0 + 0.02 * i + (i >= 50 ? 2.0 : 0.0), a = 0.1 * i;
    out << t << ',' << 200 * std::cos(a) << ',' << 30 * std::sin(a) << ',' << 100 * std::sin(2 * a) << ','
        << "0,0," << std::sin(0.2) << ',' << std::cos(0.2) << ",7\n";
  }
  return out.str();
}

TEST_F(TrajectoryTest, MotionIsLaidIntoReachWithOneScaleAndItsGapKept) {
  write(circleWithGap());
  for (const Instrument instrument :
       {Instrument::Left, Instrument::Right, Instrument::Third, Instrument::Endoscope}) {
    const MotionReport r = fromMotion(path, box, instrument, 0.3);
    const auto k = static_cast<std::size_t>(instrument);
    ASSERT_EQ(r.trajectory.rows.size(), 100u) << "no row lost, none invented";
    ASSERT_EQ(r.gaps.size(), 1u);
    EXPECT_NEAR(r.gaps[0].from, 0.98, 1e-9);
    EXPECT_NEAR(r.gaps[0].to, 3.0, 1e-9);
    EXPECT_LE(r.scale, 0.25 + 1e-3);
    EXPECT_EQ(r.trajectory.rows.front().t, 0.0);
    const auto& arm = box.arms[k];
    Eigen::Vector3d low(1, 1, 1), high(-1, -1, -1);
    for (const Row& row : r.trajectory.rows) {
      const Eigen::Vector3d tip = forwardKinematics(arm.X_BTrocar, row.joints[k]).translation();
      low = low.cwiseMin(tip);
      high = high.cwiseMax(tip);
    }
    // Shape kept: one scale, device x, −z and y are the box's x, y and z.
    EXPECT_NEAR(high.x() - low.x(), r.scale * 0.4, 0.002);
    EXPECT_NEAR(high.y() - low.y(), r.scale * 0.2, 0.002);
    EXPECT_NEAR(high.z() - low.z(), r.scale * 0.06, 0.002);
    EXPECT_NEAR(0.5 * (high.x() + low.x()), arm.aim_B.x(), 1e-3);
    EXPECT_GT(low.z(), 0.0);
  }
}

TEST_F(TrajectoryTest, TheCsvHasTheEmulatorsColumnsAndOnlyThose) {
  write(circleWithGap());
  std::ostringstream out;
  writeCsv(fromMotion(path, box, Instrument::Left, 0.3).trajectory, out);
  EXPECT_EQ(out.str().substr(0, out.str().find('\n')),
            "t_s,left_yaw,left_pitch,left_insertion,left_roll,left_jaw");
}

TEST_F(TrajectoryTest, BrokenMotionIsRefusedWithLineAndColumn) {
  EXPECT_NE(refusal("t_s,px_mm\n0,1\n", true).find("py_mm"), std::string::npos);
  const std::string h = "t_s,px_mm,py_mm,pz_mm,qx,qy,qz,qw\n0,0,0,0,0,0,0,1\n";
  EXPECT_NE(refusal(h + "1,nan,0,0,0,0,0,1\n", true).find("line 3: px_mm"), std::string::npos);
  EXPECT_NE(refusal(h + "1,2\n", true).find("line 3: py_mm: missing"), std::string::npos);
  EXPECT_NE(refusal(h + "0,0,0,0,0,0,0,1\n", true).find("does not grow"), std::string::npos);
  EXPECT_NE(refusal(h + "1,0,0,0,0,0,0,2\n", true).find("quaternion"), std::string::npos);
  EXPECT_NE(refusal("qw," + h, true).find("column 'qw' stands there twice"), std::string::npos);
  EXPECT_NE(refusal(h, true).find("fewer than two"), std::string::npos);
}

const char* const kWaypoints = R"(
instruments:
  left:
    - {t: 0.0, tip: [-0.03, 0.03, 0.08], roll: 0.0, jaw: 0.8}
    - {t: 1.0, tip: [-0.05, 0.05, 0.05], roll: 1.0}
    - {t: 1.5, tip: [-0.05, 0.05, 0.05], jaw: 0.0}
  endoscope:
    - {t: 0.0, tip: [0.0, -0.05, 0.11], jaw: 0.6}
footswitches:
  - {t: 0.5, pressed: [coag, 5]}
  - {t: 1.0, pressed: []}
tools: {left: coagulation_hook, third: none}
tool_tray: [scissors, clip_applier]
)";

TEST_F(TrajectoryTest, WaypointsAreMetExactlyAndJoinedSmoothly) {
  write(kWaypoints);
  const Trajectory t = fromWaypoints(path, box);
  ASSERT_EQ(t.rows.size(), 151u);
  EXPECT_TRUE(t.moves[0] && t.moves[3] && !t.moves[1] && !t.moves[2]);
  const auto tip = [&](std::size_t row) {
    return Eigen::Vector3d(forwardKinematics(box.arms[0].X_BTrocar, t.rows[row].joints[0]).translation());
  };
  EXPECT_LT((tip(0) - Eigen::Vector3d(-0.03, 0.03, 0.08)).norm(), 1e-9);
  EXPECT_LT((tip(100) - Eigen::Vector3d(-0.05, 0.05, 0.05)).norm(), 1e-9);
  EXPECT_LT((tip(50) - Eigen::Vector3d(-0.04, 0.04, 0.065)).norm(), 1e-9) << "half way at half time";
  EXPECT_LT((tip(1) - tip(0)).norm(), 1e-6) << "starts at rest";
  const double length = (tip(100) - tip(0)).norm();
  for (std::size_t i = 1; i <= 100; ++i) EXPECT_LE((tip(i) - tip(i - 1)).norm(), 0.01 * 1.876 * length);
  EXPECT_EQ(t.rows[100].joints[0].jaw, 0.8);
  EXPECT_EQ(t.rows[150].joints[0].jaw, 0.0);
  EXPECT_EQ(t.rows[150].joints[0].roll, 1.0);
  EXPECT_EQ(t.rows[49].footswitches, 0u);
  EXPECT_EQ(t.rows[50].footswitches, 33u);
  EXPECT_EQ(t.rows[100].footswitches, 0u);
  EXPECT_EQ(t.tools[0], vest::tools::ToolKind::CoagulationHook);
  EXPECT_FALSE(t.tools[1]) << "not named: the node's parameters hold";
  EXPECT_EQ(t.tools[2], vest::tools::ToolKind::None);
  EXPECT_EQ(t.tool_tray, (std::vector{vest::tools::ToolKind::Scissors, vest::tools::ToolKind::ClipApplier}));
  std::ostringstream out;
  writeCsv(t, out);
  EXPECT_EQ(out.str().substr(0, out.str().find('\n')),
            "t_s,left_yaw,left_pitch,left_insertion,left_roll,left_jaw,endoscope_yaw,endoscope_pitch,"
            "endoscope_insertion,endoscope_roll,endoscope_light_post,footswitches");
  // What a script says of the light post reaches the box: a view to the side is lost without it.
  std::istringstream lines(out.str());
  std::string line;
  for (int i = 0; i < 4; ++i) std::getline(lines, line);
  EXPECT_NE(line.find(",0.60000000,"), std::string::npos) << line;
}

TEST_F(TrajectoryTest, AWaypointSaidToBePassedThroughIsMetInMotionAndNothingOvershoots) {
  write(R"(
rate: 100
instruments:
  left:
    - {t: 0.0, tip: [-0.03, 0.03, 0.08], jaw: 0.0}
    - {t: 1.0, tip: [-0.04, 0.04, 0.065], jaw: 0.8, through: true}
    - {t: 2.0, tip: [-0.05, 0.05, 0.05], jaw: 0.0}
)");
  const Trajectory t = fromWaypoints(path, box);
  const auto tip = [&](std::size_t row) {
    return Eigen::Vector3d(forwardKinematics(box.arms[0].X_BTrocar, t.rows[row].joints[0]).translation());
  };
  EXPECT_LT((tip(100) - Eigen::Vector3d(-0.04, 0.04, 0.065)).norm(), 1e-9);
  EXPECT_NEAR((tip(101) - tip(99)).x(), 0.02 * -0.01, 1e-6) << "speed of the straight line through all three";
  EXPECT_LT((tip(1) - tip(0)).norm(), 1e-6);
  EXPECT_LT((tip(200) - tip(199)).norm(), 1e-6);
  for (std::size_t i = 1; i < t.rows.size(); ++i) {
    EXPECT_LT(tip(i).x(), tip(i - 1).x()) << "never back";
    EXPECT_LE(t.rows[i].joints[0].jaw, 0.8);
    EXPECT_GE(t.rows[i].joints[0].jaw, 0.0);
  }
}

TEST_F(TrajectoryTest, BrokenWaypointsAreRefusedWithTheirField) {
  const std::string one = "instruments: {left: [{t: 0, tip: [-0.03, 0.03, 0.08]}";
  EXPECT_EQ(refusal(one + "]}", false), "");
  EXPECT_NE(refusal(one + ", {t: 0, tip: [0, 0, 0.1]}]}", false).find("left[1].t"), std::string::npos);
  EXPECT_NE(refusal(one + ", {t: 1, tip: [0, 0]}]}", false).find("left[1].tip"), std::string::npos);
  EXPECT_NE(refusal(one + ", {t: 1, tip: [0, 0, .nan]}]}", false).find("left[1].tip"), std::string::npos);
  EXPECT_NE(refusal(one + ", {t: 1, tip: [0, 0, 0.5]}]}", false).find("out of reach"), std::string::npos);
  EXPECT_NE(refusal(one + ", {t: 1, tip: [0, 0, 0.1], jaw: 7}]}", false).find("left[1].jaw"),
            std::string::npos);
  EXPECT_NE(refusal(one + ", {t: 1, tip: [0, 0, 0.1], through: 7}]}", false).find("left[1].through"),
            std::string::npos);
  EXPECT_NE(refusal(one + ", {t: 1, tip: [0, 0, 0.1], speed: 7}]}", false).find("speed"), std::string::npos);
  EXPECT_NE(refusal(one + "]}\nfootswitches: [{t: 0, pressed: [laser]}]", false).find("'laser'"),
            std::string::npos);
  EXPECT_NE(refusal(one + "]}\ntools: {left: chainsaw}", false).find("tools.left: 'chainsaw'"),
            std::string::npos);
  EXPECT_NE(refusal(one + "]}\ntools: {endoscope: grasper}", false).find("endoscope"), std::string::npos);
  EXPECT_NE(refusal(one + "]}\ntool_tray: [grasper, saw]", false).find("tool_tray[1]"), std::string::npos);
  EXPECT_NE(refusal("instruments: {middle: []}", false).find("middle"), std::string::npos);
  EXPECT_NE(refusal("", false).find("not a map"), std::string::npos);
}

}  // namespace
