// Protects edges of instruments: a slanted edge becomes what its coverage of each pixel says, and where
// neither depth nor colour jumps nothing changes.
#include "vest_viz/picture/edges.h"

#include <cmath>

#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

namespace vest::picture {
namespace {

constexpr int kSize = 96;
const cv::Vec3b kNear(40, 50, 60), kFar(200, 120, 110);

/// A half plane before another, its edge turned by `angle` from the horizontal.
struct HalfPlane {
  double nx, ny;
  explicit HalfPlane(double angle) : nx(-std::sin(angle)), ny(std::cos(angle)) {}
  bool nearAt(double x, double y) const {
    return (x - 0.5 * kSize + 0.3) * nx + (y - 0.5 * kSize + 0.2) * ny > 0;
  }
  double coverage(int x, int y) const {
    int n = 0;
    for (int i = 0; i < 8; ++i)
      for (int j = 0; j < 8; ++j) n += nearAt(x + (i + 0.5) / 8 - 0.5, y + (j + 0.5) / 8 - 0.5);
    return n / 64.0;
  }
};

/// Root mean square, levels, of the first channel against the coverage, over the pixels that the edge cuts.
double error(const HalfPlane& plane, const cv::Mat& rgb) {
  double sum = 0;
  int n = 0;
  for (int y = 8; y < kSize - 8; ++y)
    for (int x = 8; x < kSize - 8; ++x) {
      const double c = plane.coverage(x, y),
                   off = c * kNear[0] + (1 - c) * kFar[0] - rgb.at<cv::Vec3b>(y, x)[0];
      if (c > 0 && c < 1) sum += off * off, ++n;
    }
  return std::sqrt(sum / n);
}

/// Half of the stairs' error at least is gone. @param behind code of depth of what lies behind; 160 before
void expectSmooth(std::uint8_t behind) {
  for (const double angle : {0.06, 0.15, 0.3, 0.6, 1.0, 1.3, 1.5, 1.9, 2.5, 3.0}) {
    SCOPED_TRACE(angle);
    const HalfPlane plane(angle);
    cv::Mat rgb(kSize, kSize, CV_8UC3), depth(kSize, kSize, CV_8U);
    for (int y = 0; y < kSize; ++y)
      for (int x = 0; x < kSize; ++x) {
        const bool near = plane.nearAt(x, y);
        rgb.at<cv::Vec3b>(y, x) = near ? kNear : kFar;
        depth.at<std::uint8_t>(y, x) = near ? 160 : behind;
      }
    const double before = error(plane, rgb);
    EdgeSmoother smoother;
    smoother.apply(depth, &rgb);
    EXPECT_LT(error(plane, rgb), 0.5 * before);
  }
}

TEST(EdgeSmoother, StairsOfAStraightEdgeBecomeItsCoverage) {
  expectSmooth(120);
}

TEST(EdgeSmoother, SoDoThoseOfAJawThatLiesOnAJaw) {
  expectSmooth(159);
}

/// A line as wide as a pixel, darker than what lies on both sides of it and as near.
TEST(EdgeSmoother, ALineOfAPixelIsNoRowOfDashes) {
  for (const double angle : {0.06, 0.15, 0.3, 1.3, 1.5, 1.9, 3.0}) {
    SCOPED_TRACE(angle);
    const HalfPlane upper(angle);
    const auto covered = [&](double x, double y) {
      const double d = (x - 0.5 * kSize + 0.3) * upper.nx + (y - 0.5 * kSize + 0.2) * upper.ny;
      return std::fabs(d) < 0.5 * std::max(std::fabs(upper.nx), std::fabs(upper.ny));
    };
    cv::Mat rgb(kSize, kSize, CV_8UC3), depth(kSize, kSize, CV_8U, cv::Scalar(160));
    for (int y = 0; y < kSize; ++y)
      for (int x = 0; x < kSize; ++x)
        rgb.at<cv::Vec3b>(y, x) = covered(x, y) ? cv::Vec3b(80, 85, 90) : cv::Vec3b(110, 111, 112);
    const auto off = [&](const cv::Mat& picture) {
      double sum = 0;
      for (int y = 8; y < kSize - 8; ++y)
        for (int x = 8; x < kSize - 8; ++x) {
          int n = 0;
          for (int i = 0; i < 64; ++i) n += covered(x + (i % 8 - 3.5) / 8, y + (i / 8 - 3.5) / 8);
          const double miss = 111 - 26 * n / 64.0 - picture.at<cv::Vec3b>(y, x)[1];
          sum += miss * miss;
        }
      return std::sqrt(sum);
    };
    const double before = off(rgb);
    EdgeSmoother smoother;
    smoother.apply(depth, &rgb);
    EXPECT_LT(off(rgb), 0.6 * before);
  }
}

// A vessel in the texture of tissue is strong here and weak there: moving the strong pixels alone made
// dashes.
TEST(EdgeSmoother, AVesselOfTheTextureStaysAsItIs) {
  cv::Mat rgb(kSize, kSize, CV_8UC3, cv::Scalar(190, 95, 88)), depth(kSize, kSize, CV_8U, cv::Scalar(160));
  for (int y = 0; y < kSize; ++y)
    rgb.at<cv::Vec3b>(y, 20 + y / 3) = y / 5 % 2 == 0 ? cv::Vec3b(120, 45, 45) : cv::Vec3b(165, 82, 76);
  const cv::Mat before = rgb.clone();
  EdgeSmoother smoother;
  smoother.apply(depth, &rgb);
  EXPECT_EQ(cv::norm(rgb, before, cv::NORM_INF), 0);
}

TEST(EdgeSmoother, HalfOfASpeckIsWhatLiesAroundIt) {
  for (const int channel : {0, 1}) {  // seen in the depth, seen in the colour
    cv::Mat rgb(kSize, kSize, CV_8UC3, kNear), depth(kSize, kSize, CV_8U, cv::Scalar(160));
    rgb.at<cv::Vec3b>(40, 40) = channel == 0 ? cv::Vec3b(140, 50, 60) : cv::Vec3b(140, 150, 60);
    if (channel == 0) depth.at<std::uint8_t>(40, 40) = 150;
    EdgeSmoother smoother;
    smoother.apply(depth, &rgb);
    EXPECT_NEAR(rgb.at<cv::Vec3b>(40, 40)[0], 90, 1);
    EXPECT_EQ(rgb.at<cv::Vec3b>(40, 41), kNear);
    EXPECT_EQ(rgb.at<cv::Vec3b>(39, 40), kNear);
  }
}

TEST(EdgeSmoother, TextureAndSlantedSurfacesStayAsTheyAre) {
  cv::Mat rgb(kSize, kSize, CV_8UC3), depth(kSize, kSize, CV_8U);
  cv::Mat texels(kSize / 4, kSize / 4, CV_8UC3);
  cv::randu(texels, 0, 110);
  cv::resize(texels, rgb, rgb.size(), 0, 0, cv::INTER_LINEAR);
  for (int y = 0; y < kSize; ++y)
    for (int x = 0; x < kSize; ++x) depth.at<std::uint8_t>(y, x) = static_cast<std::uint8_t>(2 * x + y / 3);
  const cv::Mat before = rgb.clone();
  EdgeSmoother smoother;
  smoother.apply(depth, &rgb);
  EXPECT_EQ(cv::norm(rgb, before, cv::NORM_INF), 0);
  cv::Mat tiny(2, 2, CV_8UC3, cv::Scalar(1, 2, 3)), tiny_depth(2, 2, CV_8U, cv::Scalar(9));
  smoother.apply(tiny_depth, &tiny);
  EXPECT_EQ(tiny.at<cv::Vec3b>(1, 1), cv::Vec3b(1, 2, 3));
}

}  // namespace
}  // namespace vest::picture
