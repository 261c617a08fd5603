#include <cmath>
#include <fstream>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <opencv2/calib3d.hpp>

#include "vest_viz/camera/board.h"
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

// 64 megapixels of nothing took 5 GB and minutes.
TEST(Board, PicturesLargerThanACalibrationMayBeAreNotSearched) {
  for (const cv::Size size : {cv::Size(4097, 64), cv::Size(64, 63), cv::Size(0, 0)}) {
    try {
      calibrate(std::vector<cv::Mat>(3, cv::Mat(size, CV_8U, cv::Scalar(0))), {});
      ADD_FAILURE() << size.width;
    } catch (const std::runtime_error& error) {
      EXPECT_NE(std::string(error.what()).find("allowed: 64 to 4096 each way"), std::string::npos)
          << error.what();
    }
  }
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

TEST(CameraModel, ImpossibleFieldsOfViewAreRefused) {
  EXPECT_THROW(fromFieldOfView(720, 576, 0, {}), std::invalid_argument);
  EXPECT_THROW(fromFieldOfView(720, 576, 3.2, {}), std::invalid_argument);
  EXPECT_THROW(fromFieldOfView(720, 576, std::nan(""), {}), std::invalid_argument);
  EXPECT_THROW(fromFieldOfView(0, 576, 1, {}), std::invalid_argument);
}

TEST(CameraModel, EquidistantAgreesWithOpenCvFisheye) {
  Intrinsics c = fromFieldOfView(720, 576, 1.4, {-0.02, 0.01, -0.004, 0.001, 0});
  c.model = Distortion::Equidistant;
  const cv::Matx33d K(c.fx, 0, c.cx, 0, c.fy, c.cy, 0, 0, 1);
  const std::vector<cv::Point3d> points{{0.01, 0.02, 0.05}, {-0.04, 0.01, 0.05}, {0, 0, 0.1}};
  std::vector<cv::Point2d> wanted;
  cv::fisheye::projectPoints(points, wanted, cv::Vec3d(0, 0, 0), cv::Vec3d(0, 0, 0), K,
                             cv::Vec4d(-0.02, 0.01, -0.004, 0.001));
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Eigen::Vector2d n(points[i].x / points[i].z, points[i].y / points[i].z);
    const Eigen::Vector2d p = project(c, n);
    EXPECT_NEAR(p.x(), wanted[i].x, 1e-6);
    EXPECT_NEAR(p.y(), wanted[i].y, 1e-6);
    EXPECT_NEAR((unproject(c, p) - n).norm(), 0, 1e-9);
  }
}

class CalibrationFile : public testing::Test {
 protected:
  std::string path = testing::TempDir() + "vest_calibration.yaml";
  std::string text =
      "image_width: 640\nimage_height: 480\ncamera_name: scope\n"
      "camera_matrix: {rows: 3, cols: 3, data: [500.5, 0, 320, 0, 501, 239, 0, 0, 1]}\n"
      "distortion_model: plumb_bob\n"
      "distortion_coefficients: {rows: 1, cols: 5, data: [-0.3, 0.1, 0.001, 0, 0]}\n";
  Intrinsics read(const std::string& from, const std::string& to) {
    std::string changed = text;
    const std::size_t at = changed.find(from);
    if (at != std::string::npos) changed.replace(at, from.size(), to);
    std::ofstream(path) << changed;
    return readCalibration(path);
  }
};

TEST_F(CalibrationFile, IsReadAsCameraCalibrationWritesIt) {
  const Intrinsics c = read("", "");
  EXPECT_EQ(c.width, 640u);
  EXPECT_DOUBLE_EQ(c.fx, 500.5);
  EXPECT_DOUBLE_EQ(c.cy, 239);
  EXPECT_DOUBLE_EQ(c.distortion[0], -0.3);
  EXPECT_EQ(c.model, Distortion::PlumbBob);
}

TEST_F(CalibrationFile, IsRefusedWithTheFieldThatIsWrong) {
  const auto refused = [&](const std::string& from, const std::string& to, const std::string& field) {
    try {
      read(from, to);
      ADD_FAILURE() << to << " was accepted";
    } catch (const std::runtime_error& e) {
      EXPECT_NE(std::string(e.what()).find(field), std::string::npos) << e.what();
      EXPECT_NE(std::string(e.what()).find(path), std::string::npos) << e.what();
    }
  };
  refused("plumb_bob", "thin_prism", "distortion_model");
  refused("image_height: 480\n", "image_height: 480\n\"image_height\": 48\n",
          "image_height stands there twice");
  refused("{rows: 3,", "{rows: 3, data: [1], ", "camera_matrix.data stands there twice");
  refused("500.5", ".nan", "camera_matrix");
  refused("500.5", "-1", "camera_matrix");
  refused("0, 501", "7, 501", "camera_matrix");
  refused("0, 0, 1]", "0, 0, 2]", "camera_matrix");
  refused("{rows: 3, cols: 3", "{rows: 3, cols: 2", "camera_matrix.data: 9 numbers");
  refused("{rows: 1, cols: 5", "{rows: 1, cols: 8", "distortion_coefficients.data: 5 numbers");
  refused("{rows: 1", "{rows: [1]", "distortion_coefficients.rows");
  refused("640", "0", "image_width");
  refused("image_height: 480\n", "", "image_height");
  refused("-0.3, 0.1, ", "", "distortion_coefficients");
  refused("[500.5", "{500.5", "YAML");
  EXPECT_THROW(readCalibration("/does/not/exist.yaml"), std::runtime_error);
}

}  // namespace
}  // namespace vest::camera
