#include <gtest/gtest.h>

#include "vest_instruments/collision/collision.h"

namespace {

using namespace vest::collision;
using vest::kinematics::forwardKinematics;
using vest::kinematics::JointPositions;
using vest::tools::ToolKind;

class Collision : public ::testing::Test {
 protected:
  vest::kinematics::TrainerBox box =
      vest::kinematics::loadTrainerBox(std::string(VEST_INSTRUMENTS_DIR) + "/config/trainer_box.yaml");
  CollisionModel model{box};
  std::array<ArmPose, 4> poses;

  void put(std::size_t i, const JointPositions& q) {
    poses[i] = {true, box.arms[i].tool, forwardKinematics(box.arms[i].X_BTrocar, q), q.insertion, q.jaw};
  }
  /// Puts a tip at a point of the box.
  void reach(std::size_t i, const Eigen::Vector3d& tip) {
    const auto r = vest::kinematics::inverseKinematics(
        box.arms[i].X_BTrocar, Eigen::Isometry3d(Eigen::Translation3d(tip)), {}, box.arms[i].limits);
    ASSERT_TRUE(r.reachable);
    put(i, r.q);
  }
};

TEST_F(Collision, InstrumentsAtRestTouchNothing) {
  for (std::size_t i = 0; i < 4; ++i) put(i, {0, 0, 0.08, 0, 0.5});
  for (const bool c : model.check(poses)) EXPECT_FALSE(c);
}

TEST_F(Collision, TwoTipsAtOnePointCollideAndTheOthersDoNot) {
  reach(0, {0, 0.04, 0.06});
  reach(1, {0.001, 0.04, 0.06});
  put(3, {0, 0, 0.05, 0, 0});
  const auto c = model.check(poses);
  EXPECT_TRUE(c[0]);
  EXPECT_TRUE(c[1]);
  EXPECT_FALSE(c[2]);
  EXPECT_FALSE(c[3]);
  // 20 mm apart: closed jaws, at most 5 mm wide, and the shafts behind them no longer meet.
  reach(0, {-0.01, 0.04, 0.06});
  reach(1, {0.01, 0.04, 0.06});
  EXPECT_FALSE(model.check(poses)[0]);
}

TEST_F(Collision, OpenJawsReachWhatClosedJawsDoNot) {
  reach(0, {-0.005, 0.04, 0.06});
  reach(1, {0.005, 0.04, 0.06});
  EXPECT_FALSE(model.check(poses)[0]);
  poses[0].jaw = poses[1].jaw = 1.0;
  EXPECT_TRUE(model.check(poses)[0]);
  EXPECT_TRUE(model.check(poses)[1]);
}

TEST_F(Collision, FloorAndWallsAreFelt) {
  reach(0, {-0.05, 0.05, -0.002});
  EXPECT_TRUE(model.check(poses)[0]);
  reach(0, {-0.05, 0.05, 0.01});
  EXPECT_FALSE(model.check(poses)[0]);
  reach(0, {-0.08, 0.222, 0.12});
  EXPECT_TRUE(model.check(poses)[0]);
  reach(0, {-0.08, 0.21, 0.12});
  EXPECT_FALSE(model.check(poses)[0]);
}

TEST_F(Collision, AnAbsentInstrumentTouchesNothing) {
  reach(0, {0, 0.04, 0.06});
  reach(1, {0, 0.04, 0.06});
  poses[1].present = false;
  EXPECT_FALSE(model.check(poses)[0]);
}

}  // namespace
