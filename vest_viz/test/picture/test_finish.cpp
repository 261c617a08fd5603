#include <cmath>

#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

#include "vest_viz/picture/check.h"
#include "vest_viz/picture/finish.h"
#include "vest_viz/picture/quality.h"

namespace vest::picture {
namespace {

camera::Intrinsics sampleCamera() {
  return camera::fromFieldOfView(720, 576, 70 * M_PI / 180, {-0.18, 0.03, 0, 0, 0});
}

cv::Mat rendering(const Finisher& finisher, const cv::Scalar& colour) {
  return cv::Mat(static_cast<int>(finisher.source().height), static_cast<int>(finisher.source().width),
                 CV_8UC4, colour);
}

TEST(Finisher, PictureIsRoundAndBlackOutside) {
  Finisher finisher(sampleCamera(), 1.0);
  cv::Mat rgb;
  finisher.apply(rendering(finisher, {200, 120, 110, 255}), &rgb);
  ASSERT_EQ(rgb.size(), cv::Size(720, 576));
  const Circle& c = finisher.circle();
  for (int y = 0; y < rgb.rows; ++y)
    for (int x = 0; x < rgb.cols; ++x) {
      const double r = std::hypot(x - c.cx, y - c.cy);
      const int red = rgb.at<cv::Vec3b>(y, x)[0];
      if (r > c.radius + 2) {
        EXPECT_EQ(red, 0) << x << " " << y;
      }
      if (r < c.radius - 4) {
        EXPECT_GT(red, 60) << x << " " << y;
      }
    }
}

TEST(Finisher, RimIsThinAndBright) {
  Finisher finisher(sampleCamera(), 0.9);
  cv::Mat rgb;
  finisher.apply(rendering(finisher, {0, 0, 0, 255}), &rgb);
  const Circle& c = finisher.circle();
  int lit = 0;
  for (int x = static_cast<int>(c.cx); x < rgb.cols; ++x)
    lit += rgb.at<cv::Vec3b>(static_cast<int>(c.cy), x)[0] > 30;
  EXPECT_GE(lit, 1);
  EXPECT_LE(lit, 5);
}

TEST(Finisher, PointsLandWhereTheCalibrationSays) {
  // The published camera_info must describe the picture: draw directions into the pinhole rendering, find
  // them again.
  const camera::Intrinsics camera = sampleCamera();
  Finisher finisher(camera, 1.0);
  for (const Eigen::Vector2d& n :
       {Eigen::Vector2d(0, 0), Eigen::Vector2d(0.3, 0.1), Eigen::Vector2d(-0.2, -0.4)}) {
    cv::Mat source = rendering(finisher, {0, 0, 0, 255});
    const Eigen::Vector2d s = camera::project(finisher.source(), n);
    cv::circle(source, cv::Point(cvRound(16 * s.x()), cvRound(16 * s.y())), 6 * 16, {255, 255, 255, 255}, -1,
               cv::LINE_AA, 4);
    cv::Mat rgb, grey;
    finisher.apply(source, &rgb);
    cv::cvtColor(rgb, grey, cv::COLOR_RGB2GRAY);
    const Eigen::Vector2d wanted = camera::project(camera, n);
    // The rim is not the dot.
    const cv::Rect around(cvRound(wanted.x()) - 15, cvRound(wanted.y()) - 15, 31, 31);
    const cv::Moments m = cv::moments(grey(around));
    EXPECT_NEAR(m.m10 / m.m00 + around.x, wanted.x(), 0.35);
    EXPECT_NEAR(m.m01 / m.m00 + around.y, wanted.y(), 0.35);
  }
}

TEST(Finisher, RenderingCoversTheWholeCircle) {
  const camera::Intrinsics camera = sampleCamera();
  for (double share : {0.5, 1.0, 1.3}) {
    Finisher finisher(camera, share);
    for (int i = 0; i < 360; ++i) {
      const double a = i * M_PI / 180, r = finisher.circle().radius - 1;
      const double x = finisher.circle().cx + r * std::cos(a), y = finisher.circle().cy + r * std::sin(a);
      if (x < 0 || y < 0 || x > camera.width - 1 || y > camera.height - 1) continue;
      const Eigen::Vector2d s = camera::project(finisher.source(), camera::unproject(camera, {x, y}));
      EXPECT_GE(s.minCoeff(), -0.5);
      EXPECT_LE(s.maxCoeff(), finisher.source().width - 0.5);
    }
  }
}

// Highlights are as hard as a rendering allows. Enlarged as they are they show its pixels, with dark rims
// where it is sharpened. Their size must not change by half of a rendered pixel.
TEST(Finisher, AHighlightThatIsEnlargedHasSoftRimsAndItsSize) {
  for (const double resolution : {0.55, 0.7}) {
    SCOPED_TRACE(resolution);
    Finisher finisher(sampleCamera(), 1.0, resolution);
    cv::Mat source = rendering(finisher, {110, 110, 110, 128}), rgb;
    const int middle = source.rows / 2, half = 6;
    cv::rectangle(source, {middle - half, middle - half}, {middle + half, middle + half},
                  {255, 255, 255, 128}, -1);
    finisher.apply(source, {}, &rgb);
    const int row = static_cast<int>(finisher.circle().cy),
              first = static_cast<int>(finisher.circle().cx) - 40;
    int steepest = 0, darkest = 255;
    double width = 0;
    for (int x = first; x < first + 80; ++x) {
      const int here = rgb.at<cv::Vec3b>(row, x)[1], next = rgb.at<cv::Vec3b>(row, x + 1)[1];
      steepest = std::max(steepest, std::abs(next - here));
      darkest = std::min(darkest, here);
      width += (here - 110) / 145.0;
    }
    EXPECT_LT(steepest, 75);
    EXPECT_GE(darkest, 106);
    const auto at = [&](double x) {  // of a pixel of the picture in the rendering
      return camera::project(finisher.source(), camera::unproject(sampleCamera(), {x, double(row)})).x();
    };
    EXPECT_NEAR(width * (at(first + 41) - at(first + 40)), 2 * half + 1, 1.0);
  }
}

TEST(Finisher, EdgeIsDarkerThanTheMiddle) {
  Finisher finisher(sampleCamera(), 1.0);
  cv::Mat rgb;
  finisher.apply(rendering(finisher, {200, 200, 200, 255}), &rgb);
  const Circle& c = finisher.circle();
  // Vignette of 1 - r^4 / 2.
  for (const double r : {0.0, 0.3, 0.6, 0.9})
    for (const double a : {0.3, 2.0, 4.5}) {
      const cv::Point at(static_cast<int>(std::lround(c.cx + r * c.radius * std::cos(a))),
                         static_cast<int>(std::lround(c.cy + r * c.radius * std::sin(a))));
      EXPECT_NEAR(rgb.at<cv::Vec3b>(at)[1], 200 * (1 - 0.5 * r * r * r * r), 3) << r;
    }
}

// Protects that a wet highlight near the rim is white as in the middle: it is far brighter than the picture's
// white, so that what the lens loses there leaves it white. (It was grey.)
TEST(Finisher, AHighlightStaysWhiteTowardsTheEdge) {
  Finisher finisher(sampleCamera(), 1.0);
  cv::Mat lamp, tissue;
  finisher.apply(rendering(finisher, {250, 250, 252, 255}), &lamp);
  finisher.apply(rendering(finisher, {240, 200, 190, 255}), &tissue);
  const Circle& c = finisher.circle();
  const auto at = [&](const cv::Mat& picture, double share) {
    return static_cast<int>(
        picture.at<cv::Vec3b>(static_cast<int>(c.cy), static_cast<int>(c.cx + share * c.radius))[0]);
  };
  for (const double share : {0.0, 0.5, 0.8, 0.93}) EXPECT_GE(at(lamp, share), 250) << share;
  EXPECT_LT(at(tissue, 0.93), 0.75 * at(tissue, 0.0)) << "tissue is darker there";
}

TEST(Quality, FollowsTheFrameTimeAndSettles) {
  // A machine that needs `ms` for all pixels: drawing time goes with their number.
  for (const double ms : {5.0, 12.0, 20.0, 40.0, 60.0, 200.0}) {
    std::size_t level = 2, before = 2;
    for (int k = 0; k < 8; ++k)
      before = level, level = nextLevel(level, ms * kResolutions[level] * kResolutions[level]);
    EXPECT_EQ(level, before) << "goes to and fro at " << ms << " ms";
    if (ms <= 12) {
      EXPECT_EQ(level, 0u) << "every pixel on a fast machine";
    }
    if (ms >= 200) {
      EXPECT_EQ(level, kResolutions.size() - 1) << "the fewest on a slow one";
    }
  }
}

TEST(AutoExposure, DarkAndBrightPicturesConvergeToTheSameLevel) {
  Finisher finisher(sampleCamera(), 1.0);
  for (double radiance : {10.0, 60.0, 400.0}) {
    AutoExposure exposure;
    cv::Mat rgb;
    double level = 0;
    for (int i = 0; i < 60; ++i) {
      // Same response as the shader: square root of a saturating curve.
      level = 255 * std::sqrt(1 - std::exp(-exposure.gain() * radiance / 255));
      finisher.apply(rendering(finisher, cv::Scalar(level, level, level, 255)), &rgb);
      exposure.update(rgb, finisher.circle(), 0.04, exposure.gain());
    }
    EXPECT_NEAR(level, 106, 15) << radiance;
  }
}

// On a machine that draws one picture a second, each finished while the next is drawn.
TEST(AutoExposure, SlowPicturesFromAWorkerDoNotSwing) {
  Finisher finisher(sampleCamera(), 1.0);
  AutoExposure exposure;
  cv::Mat rgb;
  double drawn = exposure.gain(), level = 0;
  for (int i = 0; i < 60; ++i) {
    level = 255 * std::sqrt(1 - std::exp(-drawn * (i < 30 ? 60.0 : 15.0) / 255));
    const double next = exposure.gain();
    finisher.apply(rendering(finisher, cv::Scalar(level, level, level, 255)), &rgb);
    exposure.update(rgb, finisher.circle(), 1.0, drawn);
    drawn = next;
    if (i == 29 || i > 56) {
      EXPECT_NEAR(level, 101, 8) << i;
    }
  }
}

TEST(AutoExposure, BlackPictureDoesNotRunAway) {
  AutoExposure exposure;
  const cv::Mat black = cv::Mat::zeros(576, 720, CV_8UC3);
  for (int i = 0; i < 200; ++i) exposure.update(black, {360, 288, 280}, 0.04, exposure.gain());
  EXPECT_LE(exposure.gain(), 50.0);
}

}  // namespace
}  // namespace vest::picture
