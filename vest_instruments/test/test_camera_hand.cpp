// Protects the assistant's hand: the view goes where it is sent as the picture shows it, the horizon stays
// level whatever the trocar, limits hold, and a hand that centres an instrument arrives there and rests.
#include <cmath>

#include <gtest/gtest.h>

#include "vest_instruments/control/camera_hand.h"
#include "vest_instruments/kinematics/jacobian.h"
#include "vest_instruments/kinematics/trainer_box.h"

namespace vest::control {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;
using kinematics::forwardKinematics;
using kinematics::JointLimits;
using kinematics::JointPositions;

/// The endoscope's trocar, and others that stand aslant; with an optic of 30° none looks past straight down.
std::vector<Isometry3d> trocars() {
  return {kinematics::trocarFrame({0.0, -0.14, 0.165}, {0.0, 0.055, 0.055}),
          kinematics::trocarFrame({0.08, -0.10, 0.17}, {-0.02, 0.05, 0.05}),
          kinematics::trocarFrame({-0.05, -0.1, 0.12}, {0.03, 0.05, 0.06})};
}

const Eigen::Matrix3d kStraight = Eigen::Matrix3d::Identity();

void expectLevel(const Isometry3d& X_WTrocar, const JointPositions& q, const Eigen::Matrix3d& R_TipOptical) {
  const Eigen::Matrix3d R = forwardKinematics(X_WTrocar, q).linear() * R_TipOptical;
  EXPECT_NEAR(R(2, 0), 0, 1e-9) << "the picture's right is horizontal";
  EXPECT_LT(R(2, 1), 0) << "down is down";
}

TEST(CameraHand, KeepsTheHorizonLevelWhereverItLooks) {
  for (const Isometry3d& X : trocars())
    for (const double light_post : {0.0, 0.5, -1.2}) {
      const Eigen::Matrix3d optic = kinematics::opticalFrame(M_PI / 6, light_post).linear();
      JointPositions q;
      q.insertion = 0.1;
      for (int i = 0; i < 400; ++i) {
        q = moveCamera(X, q, {0.01 * std::sin(0.05 * i), 0.002 * std::cos(0.03 * i), 1e-4}, {}, optic);
        expectLevel(X, q, optic);
      }
    }
}

TEST(CameraHand, TurnsAsThePictureShowsItAndGoesInAlongTheShaft) {
  for (const Isometry3d& X : trocars()) {
    JointPositions q;
    q.insertion = 0.1;
    q = moveCamera(X, q, {}, {}, kStraight);  // level
    q.jaw = 0.4;
    const Isometry3d before = forwardKinematics(X, q);
    const auto turned = [&](const CameraMotion& motion) {
      const JointPositions next = moveCamera(X, q, motion, {}, kStraight);
      EXPECT_EQ(next.jaw, 0.4) << "the light post is not the hand's";
      return Vector3d(before.linear().transpose() * forwardKinematics(X, next).linear().col(2));
    };
    const Vector3d right = turned({0.02, 0, 0}), down = turned({0, 0.02, 0});
    EXPECT_NEAR(std::atan2(right.x(), right.z()), 0.02, 1e-4);
    EXPECT_NEAR(right.y(), 0, 1e-4);
    EXPECT_NEAR(std::atan2(down.y(), down.z()), 0.02, 1e-4);
    EXPECT_NEAR(down.x(), 0, 1e-4);
    const Vector3d in = forwardKinematics(X, moveCamera(X, q, {0, 0, 0.01}, {}, kStraight)).translation();
    EXPECT_NEAR((in - before.translation() - 0.01 * before.linear().col(2)).norm(), 0, 1e-9);
  }
}

TEST(CameraHand, StaysInsideTheLimits) {
  const Isometry3d X = trocars()[0];
  JointLimits limits;
  JointPositions q;
  for (int i = 0; i < 1000; ++i) q = moveCamera(X, q, {0.01, -0.004, 0.001}, limits, kStraight);
  EXPECT_LE(q.yaw, limits.upper.yaw);
  EXPECT_LE(q.pitch, limits.upper.pitch);
  EXPECT_DOUBLE_EQ(q.insertion, limits.upper.insertion);
  for (int i = 0; i < 1000; ++i) q = moveCamera(X, q, {0, 0, -0.001}, limits, kStraight);
  EXPECT_DOUBLE_EQ(q.insertion, limits.lower.insertion);
}

TEST(CameraHand, AShaftThatStandsUprightKeepsItsRoll) {
  const Isometry3d X = kinematics::trocarFrame({0, 0, 0.2}, {0, 1e-9, 0.05});
  JointPositions q;
  q.roll = 0.3;
  EXPECT_NEAR(levelRoll(X, q, kStraight), 0.3, 1e-12);
}

TEST(CameraHand, CentresAPointAtABoundedSpeedAndThenRests) {
  const Isometry3d X = trocars()[0];
  const Vector3d p(0.04, 0.05, 0.06);  // in front of the endoscope, to the right
  constexpr double kStep = 0.01, kDeadZone = 0.05;
  JointPositions q;
  q.insertion = 0.08;
  q = moveCamera(X, q, {}, {}, kStraight);
  const auto seen = [&] { return Vector3d(forwardKinematics(X, q).inverse() * p); };
  for (int i = 0; i < 500; ++i) {
    const Isometry3d before = forwardKinematics(X, q);
    q = moveCamera(X, q, follow(seen(), kDeadZone, kStep), {}, kStraight);
    const Eigen::Matrix3d turn = before.linear().transpose() * forwardKinematics(X, q).linear();
    EXPECT_LE(std::acos(std::min(1.0, turn(2, 2))), 1.01 * kCameraSpeed * kStep);
  }
  const Vector3d s = seen();
  EXPECT_LT(std::hypot(std::atan2(s.x(), s.z()), std::atan2(s.y(), s.z())), kDeadZone + 1e-3);
  const CameraMotion rest = follow({0.001, 0, 0.1}, kDeadZone, kStep);
  EXPECT_EQ(rest.right, 0) << "inside the dead zone";
  EXPECT_EQ(follow({0.1, 0, -0.1}, kDeadZone, kStep).right, 0) << "behind the lens";
  EXPECT_EQ(follow({std::nan(""), 0, 0.1}, kDeadZone, kStep).right, 0);
}

}  // namespace
}  // namespace vest::control
