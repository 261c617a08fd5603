#include <cmath>
#include <random>
#include <stdexcept>

#include <gtest/gtest.h>
#include <opencv2/calib3d.hpp>

#include "vest_viz/camera/model.h"

namespace vest::camera {
namespace {

const std::array<double, 5> kBarrel{-0.18, 0.03, 0.001, -0.002, 0.004};

TEST(CameraModel, HorizontalFieldOfViewIsThatOfThePinhole) {
  const Intrinsics c = fromFieldOfView(720, 576, 70 * M_PI / 180, {});
  // The picture's edges lie half a pixel beyond the outermost pixel centres.
  EXPECT_NEAR(2 * std::atan((719.5 - c.cx) / c.fx) * 180 / M_PI, 70.0, 1e-9);
  EXPECT_DOUBLE_EQ(c.fx, c.fy);
}

TEST(CameraModel, AgreesWithOpenCvProjectPoints) {
  const Intrinsics c = fromFieldOfView(720, 576, 1.2, kBarrel);
  std::mt19937 random(3);
  std::uniform_real_distribution<double> side(-0.05, 0.05), ahead(0.05, 0.2);
  std::vector<cv::Point3d> points;
  for (int i = 0; i < 500; ++i) points.emplace_back(side(random), side(random), ahead(random));
  const cv::Matx33d K(c.fx, 0, c.cx, 0, c.fy, c.cy, 0, 0, 1);
  std::vector<cv::Point2d> wanted;
  cv::projectPoints(points, cv::Vec3d(0, 0, 0), cv::Vec3d(0, 0, 0), K,
                    std::vector<double>(kBarrel.begin(), kBarrel.end()), wanted);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Eigen::Vector2d p = project(c, {points[i].x / points[i].z, points[i].y / points[i].z});
    EXPECT_NEAR(p.x(), wanted[i].x, 1e-9);
    EXPECT_NEAR(p.y(), wanted[i].y, 1e-9);
  }
}

TEST(CameraModel, UnprojectInvertsProject) {
  const Intrinsics c = fromFieldOfView(720, 576, 70 * M_PI / 180, kBarrel);
  for (double x = 80; x < 640; x += 37)
    for (double y = 10; y < 570; y += 29) {
      const Eigen::Vector2d back = project(c, unproject(c, {x, y}));
      EXPECT_NEAR(back.x(), x, 1e-6);
      EXPECT_NEAR(back.y(), y, 1e-6);
    }
}

TEST(CameraModel, GlProjectionPutsPointsOnTheSamePixels) {
  Intrinsics c = fromFieldOfView(640, 480, 1.0, {});
  c.cx += 11;  // off-centre on purpose
  c.cy -= 7;
  const Eigen::Matrix4d P = glProjection(c, 0.002, 0.8);
  for (const Eigen::Vector3d& p : {Eigen::Vector3d(0.01, 0.02, 0.1), Eigen::Vector3d(-0.03, 0.015, 0.2)}) {
    const Eigen::Vector2d pixel = project(c, {p.x() / p.z(), p.y() / p.z()});
    const Eigen::Vector4d clip = P * Eigen::Vector4d(p.x(), -p.y(), -p.z(), 1);
    EXPECT_NEAR((clip.x() / clip.w() + 1) / 2 * c.width - 0.5, pixel.x(), 1e-9);
    EXPECT_NEAR((1 - clip.y() / clip.w()) / 2 * c.height - 0.5, pixel.y(), 1e-9);
  }
  const Eigen::Vector4d near = P * Eigen::Vector4d(0, 0, -0.002, 1), far = P * Eigen::Vector4d(0, 0, -0.8, 1);
  EXPECT_NEAR(near.z() / near.w(), -1, 1e-9);
  EXPECT_NEAR(far.z() / far.w(), 1, 1e-9);
}

TEST(CameraModel, StraightOpticsLookAlongTheShaft) {
  const Eigen::Isometry3d X = opticalFrame(Eigen::Isometry3d::Identity(), 0, 0.7);
  EXPECT_TRUE(X.isApprox(Eigen::Isometry3d::Identity(), 1e-12));
}

TEST(CameraModel, AngledOpticsLookDownAndTheLightPostTurnsTheViewNotTheHorizon) {
  const double tilt = 30 * M_PI / 180;
  const Eigen::Vector3d down = opticalFrame(Eigen::Isometry3d::Identity(), tilt, 0).linear().col(2);
  EXPECT_NEAR(down.y(), std::sin(tilt), 1e-12);  // y is down
  EXPECT_NEAR(down.z(), std::cos(tilt), 1e-12);
  const Eigen::Isometry3d turned = opticalFrame(Eigen::Isometry3d::Identity(), tilt, M_PI / 2);
  EXPECT_NEAR(turned.linear().col(2).x(), -std::sin(tilt), 1e-12);
  EXPECT_NEAR(turned.linear().col(1).y(), 1.0, 1e-12);  // still upright
}

TEST(CameraModel, ImpossibleFieldsOfViewAreRefused) {
  EXPECT_THROW(fromFieldOfView(720, 576, 0, {}), std::invalid_argument);
  EXPECT_THROW(fromFieldOfView(720, 576, 3.2, {}), std::invalid_argument);
  EXPECT_THROW(fromFieldOfView(720, 576, std::nan(""), {}), std::invalid_argument);
  EXPECT_THROW(fromFieldOfView(0, 576, 1, {}), std::invalid_argument);
}

}  // namespace
}  // namespace vest::camera
