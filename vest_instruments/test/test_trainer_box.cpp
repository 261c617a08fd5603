#include <cmath>
#include <string>

#include <gtest/gtest.h>

#include "refusal.h"
#include "vest_instruments/kinematics/jacobian.h"
#include "vest_instruments/kinematics/trainer_box.h"

namespace {

using namespace vest::kinematics;
using Eigen::Isometry3d;
using Eigen::Vector3d;
using vest::tools::Instrument;
using vest::tools::ToolKind;

const std::string kShipped = std::string(VEST_INSTRUMENTS_DIR) + "/config/trainer_box.yaml";

std::string refusal(const std::string& text) {
  return vest::testing::refusal(text, loadTrainerBox);
}

std::string with(const std::string& from, const std::string& to) {
  return vest::testing::changed(vest::testing::fileText(kShipped), from, to);
}

TEST(TrainerBox, TheShippedLayoutLoadsAndTrocarsPointAtTheirAims) {
  const TrainerBox box = loadTrainerBox(kShipped);
  EXPECT_TRUE(box.inside.isApprox(Vector3d(0.36, 0.44, 0.20)));
  for (const TrainerArm& arm : box.arms) {
    ASSERT_TRUE(arm.present);
    EXPECT_LT((arm.X_BTrocar * Vector3d(0, 0, (arm.aim_B - arm.pivot_B).norm()) - arm.aim_B).norm(), 1e-12);
    const Eigen::Matrix3d R = arm.X_BTrocar.linear();
    EXPECT_NEAR(R.determinant(), 1.0, 1e-12);
    EXPECT_TRUE((R.transpose() * R).isIdentity(1e-12));
    EXPECT_GT(R(0, 0), 0.5) << "x of the trocar points to the right";
  }
  EXPECT_EQ(box.arm(Instrument::Endoscope).tool, ToolKind::Endoscope);
  EXPECT_EQ(box.arm(Instrument::Left).limits.upper.insertion, 0.28);
}

// Worked out by hand: pivot (0,-0.14,0.165), aim (0,0.055,0.055): z = (0, 0.195, -0.11) / 0.22388…
TEST(TrainerBox, TheEndoscopeAtZeroAnglesSeesUpAsUp) {
  const TrainerBox box = loadTrainerBox(kShipped);
  const Isometry3d& X = box.arm(Instrument::Endoscope).X_BTrocar;
  const double n = std::hypot(0.195, 0.11);
  EXPECT_TRUE(X.linear().col(2).isApprox(Vector3d(0, 0.195 / n, -0.11 / n), 1e-12));
  EXPECT_TRUE(X.linear().col(0).isApprox(Vector3d::UnitX(), 1e-12));
  const Isometry3d camera = X * opticalFrame(0.0, 0.0);
  EXPECT_GT(-camera.linear().col(1).z(), 0.8) << "minus y of the optical frame is up";
  // A tilt of 30 degrees at light post 0 looks further down, and keeps x to the right.
  const Isometry3d tilted = X * opticalFrame(M_PI / 6, 0.0);
  EXPECT_NEAR(tilted.linear().col(2).dot(camera.linear().col(2)), std::cos(M_PI / 6), 1e-12);
  EXPECT_LT(tilted.linear().col(2).z(), camera.linear().col(2).z() - 0.2);
  EXPECT_TRUE(tilted.linear().col(0).isApprox(Vector3d::UnitX(), 1e-12));
  // The light post turned by half a turn looks up instead; the camera keeps its x.
  const Isometry3d turned = X * opticalFrame(M_PI / 6, M_PI);
  EXPECT_GT(turned.linear().col(2).z(), camera.linear().col(2).z() + 0.2);
  EXPECT_TRUE(turned.linear().col(0).isApprox(Vector3d::UnitX(), 1e-12));
}

TEST(TrainerBox, ABoxMayHaveTwoInstrumentsOnly) {
  std::string text = vest::testing::fileText(kShipped);
  const std::size_t from = text.find("  third:"), to = text.find("  endoscope:");
  text.erase(from, to - from);
  const std::string path = ::testing::TempDir() + "/vest_two_instruments.yaml";
  std::ofstream(path) << text;
  EXPECT_FALSE(loadTrainerBox(path).arm(Instrument::Third).present);
  std::remove(path.c_str());
}

TEST(TrainerBox, EachMistakeIsRefusedWithTheFieldThatHoldsIt) {
  EXPECT_EQ(refusal(vest::testing::fileText(kShipped)), "");
  EXPECT_NE(refusal(with("dome: 0.03", "dome: 0.03\n  colour: red")).find("unknown key 'colour'"),
            std::string::npos);
  EXPECT_NE(refusal(with("dome: 0.03", "")).find("box.dome: missing"), std::string::npos);
  EXPECT_NE(refusal(with("dome: 0.03", "dome: .nan")).find("box.dome"), std::string::npos);
  EXPECT_NE(refusal(with("dome: 0.03", "dome: -1")).find("box.dome"), std::string::npos);
  EXPECT_NE(refusal(with("dome: 0.03", "dome: wide")).find("'wide' is no number"), std::string::npos);
  EXPECT_NE(refusal(with("[0.0, 0.28]", "[0.28, 0.1]")).find("limits.insertion"), std::string::npos);
  EXPECT_NE(refusal(with("tool: grasper", "tool: spoon")).find("instruments.left.tool: 'spoon'"),
            std::string::npos);
  EXPECT_NE(refusal(with("tool: grasper", "tool: endoscope")).find("instruments.left.tool"),
            std::string::npos);
  EXPECT_NE(
      refusal(with("aim: [-0.02, 0.05, 0.055]", "aim: [-0.115, -0.02, 0.165]")).find("instruments.left.aim"),
      std::string::npos);
  EXPECT_NE(refusal(with("aim: [-0.02, 0.05, 0.055]", "aim: [-0.02, 0.05]")).find("instruments.left.aim"),
            std::string::npos);
  EXPECT_NE(refusal(with("  right:", "  fourth:")).find("fourth"), std::string::npos);
  EXPECT_NE(refusal("box: &a {b: *a}").find("alias"), std::string::npos);
  EXPECT_NE(refusal(std::string(100000, ' ')).find("65536 bytes"), std::string::npos);
  EXPECT_NE(refusal(std::string(5000, '[')).find("nesting"), std::string::npos);
  EXPECT_NE(refusal("box: [").find("line"), std::string::npos);
  EXPECT_NE(refusal("").find("not a map"), std::string::npos);
}

// Protects: the sign and frame of every column, which haptics will map forces with.
TEST(Jacobian, AgreesWithFiniteDifferencesOfTheForwardKinematics) {
  const TrainerBox box = loadTrainerBox(kShipped);
  const Isometry3d& X = box.arm(Instrument::Third).X_BTrocar;
  for (const JointPositions q :
       {JointPositions{0.3, -0.4, 0.12, 0.7, 0}, JointPositions{-1.0, 0.9, 0.25, -2.0, 0},
        JointPositions{0, 0, 0.05, 0, 0}}) {
    const auto J = tipJacobian(X, q);
    for (int k = 0; k < 4; ++k) {
      const double h = 1e-6;
      JointPositions a = q, b = q;
      double* pa[4] = {&a.yaw, &a.pitch, &a.insertion, &a.roll};
      double* pb[4] = {&b.yaw, &b.pitch, &b.insertion, &b.roll};
      *pa[k] -= h;
      *pb[k] += h;
      const Isometry3d Xa = forwardKinematics(X, a), Xb = forwardKinematics(X, b);
      const Vector3d v = (Xb.translation() - Xa.translation()) / (2 * h);
      const Eigen::Matrix3d S =
          (Xb.linear() - Xa.linear()) / (2 * h) * forwardKinematics(X, q).linear().transpose();
      const Vector3d w(S(2, 1), S(0, 2), S(1, 0));
      EXPECT_LT((J.block<3, 1>(0, k) - v).norm(), 1e-8) << k;
      EXPECT_LT((J.block<3, 1>(3, k) - w).norm(), 1e-8) << k;
    }
  }
}

TEST(TiltedBox, IsTurnedAboutItsOwnXAndThenAboutItsOwnY) {
  const double a = 0.3, b = 0.5;
  const Eigen::Matrix3d R = vest::kinematics::tiltedBox(a, b).linear();
  // By hand: y is turned about x alone; z first leans in x, then is turned about the world's x.
  EXPECT_TRUE(R.col(1).isApprox(Vector3d(0, std::cos(a), std::sin(a)), 1e-12)) << R;
  EXPECT_TRUE(
      R.col(2).isApprox(Vector3d(std::sin(b), -std::sin(a) * std::cos(b), std::cos(a) * std::cos(b)), 1e-12))
      << R;
}

}  // namespace
