#include <cmath>

#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

#include "vest_viz/picture/finish.h"

namespace vest::picture {
namespace {

camera::Intrinsics sampleCamera() {
  return camera::fromFieldOfView(360, 288, 70 * M_PI / 180, {-0.18, 0.03, 0, 0, 0});
}

/// Vertical stripes of 4 pixels at a depth.
cv::Mat stripes(const Finisher& finisher, double depth) {
  const auto code = static_cast<int>(std::lround(255 * (1 - std::sqrt(depth / 0.3))));
  cv::Mat out(static_cast<int>(finisher.source().height), static_cast<int>(finisher.source().width), CV_8UC4,
              cv::Scalar(60, 40, 40, code));
  for (int x = 0; x < out.cols; x += 8)
    out(cv::Rect(x, 0, std::min(4, out.cols - x), out.rows)).setTo(cv::Scalar(180, 140, 130, code));
  return out;
}

/// Standard deviation of red around the middle: contrast of the stripes.
double contrast(const cv::Mat& rgb, const cv::Rect& where) {
  cv::Scalar mean, deviation;
  cv::meanStdDev(rgb(where), mean, deviation);
  return deviation[0];
}
const cv::Rect kMiddle(150, 120, 60, 48), kLeft(60, 120, 40, 48), kRight(260, 120, 40, 48);

TEST(Lens, FogTakesTheContrastAndClearsAgain) {
  Finisher finisher(sampleCamera(), 1.0);
  const cv::Mat source = stripes(finisher, 0.1);
  cv::Mat clear, fogged, again;
  finisher.apply(source, &clear);
  Lens lens;
  lens.fog = 0.8;
  finisher.setLens(lens);
  finisher.apply(source, &fogged);
  EXPECT_LT(contrast(fogged, kMiddle), 0.2 * contrast(clear, kMiddle));
  EXPECT_GT(cv::mean(fogged(kMiddle))[0], 60) << "fog is a veil, not darkness";
  lens.fog = 0.33;
  finisher.setLens(lens);
  finisher.apply(source, &fogged);
  EXPECT_LT(contrast(fogged, kMiddle), 0.6 * contrast(clear, kMiddle)) << "a third of it is plainly seen";
  cv::Mat dark(source.size(), CV_8UC4, cv::Scalar(0, 0, 0, 100));
  source(cv::Rect(0, 0, source.cols / 2, source.rows))
      .copyTo(dark(cv::Rect(0, 0, source.cols / 2, source.rows)));
  finisher.apply(dark, &fogged);
  EXPECT_GT(cv::mean(fogged(kRight))[0], 12) << "milky where it was black";
  finisher.setLens({});
  finisher.apply(source, &again);
  EXPECT_EQ(cv::norm(clear, again), 0);
}

TEST(Lens, BrightTissueUnderFogHasNoPatchesOfItsOwn) {
  // Its red is as high as a highlight's: where it passed the highlights' bound, pink blocks with hard edges
  // stood.
  Finisher finisher(sampleCamera(), 1.0);
  cv::Mat source = stripes(finisher, 0.1);
  source.setTo(cv::Scalar(222, 170, 160, 100));
  source(cv::Rect(source.cols / 2, 0, source.cols / 2, source.rows)).setTo(cv::Scalar(240, 170, 160, 100));
  Lens lens;
  lens.fog = 0.33;
  finisher.setLens(lens);
  cv::Mat fogged;
  finisher.apply(source, &fogged);
  EXPECT_LT(cv::mean(fogged(kRight))[0] - cv::mean(fogged(kLeft))[0], 240 - 222)
      << "no more than without fog";
  EXPECT_NEAR(cv::mean(fogged(kRight))[1], cv::mean(fogged(kLeft))[1], 2);
}

TEST(Lens, FogLiesWhereItsMapSays) {
  Finisher finisher(sampleCamera(), 1.0);
  const cv::Mat source = stripes(finisher, 0.1);
  cv::Mat clear, fogged;
  finisher.apply(source, &clear);
  Lens lens;
  lens.columns = 36, lens.rows = 28;
  lens.fog = 0.4;
  for (int r = 0; r < 28; ++r)
    for (int c = 0; c < 36; ++c) lens.fogging.push_back(c < 18 ? 204 : 0);
  finisher.setLens(lens);
  finisher.apply(source, &fogged);
  EXPECT_LT(contrast(fogged, kLeft), 0.2 * contrast(clear, kLeft));
  EXPECT_GT(contrast(fogged, kRight), 0.97 * contrast(clear, kRight));
}

TEST(Lens, BloodOnOneSideReddensAndHidesThatSideOnly) {
  Finisher finisher(sampleCamera(), 1.0);
  const cv::Mat source = stripes(finisher, 0.1);
  cv::Mat clear, soiled;
  finisher.apply(source, &clear);
  Lens lens;
  lens.columns = 36, lens.rows = 28;
  for (int r = 0; r < 28; ++r)
    for (int c = 0; c < 36; ++c) {
      lens.soiling.push_back(c < 13 ? 255 : 0);
      lens.blood.push_back(255);
    }
  finisher.setLens(lens);
  finisher.apply(source, &soiled);
  const cv::Scalar left = cv::mean(soiled(kLeft));
  EXPECT_GT(left[0], 4 * left[1]) << "red";
  EXPECT_LT(contrast(soiled, kLeft), 0.2 * contrast(clear, kLeft));
  EXPECT_EQ(cv::norm(clear(kRight), soiled(kRight)), 0);
  lens.soiling.pop_back();  // does not fit columns x rows: clean
  finisher.setLens(lens);
  finisher.apply(source, &soiled);
  EXPECT_EQ(cv::norm(clear, soiled), 0);
}

TEST(CameraLook, WhiteBalanceFollowsPlanckAndIsNeutralForTheLampItself) {
  EXPECT_DOUBLE_EQ(whiteBalance(5600, 5600)[0], 1.0);
  EXPECT_DOUBLE_EQ(whiteBalance(5600, 5600)[2], 1.0);
  const auto warm = whiteBalance(3200, 5600);  // a halogen lamp under a camera set to xenon
  EXPECT_GT(warm[0], 1.2);
  EXPECT_LT(warm[2], 0.7);
  Finisher finisher(sampleCamera(), 1.0);
  const cv::Mat grey(static_cast<int>(finisher.source().height), static_cast<int>(finisher.source().width),
                     CV_8UC4, cv::Scalar(120, 120, 120, 100));
  CameraLook look;
  look.lamp = 3200;
  finisher.setLook(look);
  cv::Mat rgb;
  finisher.apply(grey, &rgb);
  const cv::Scalar mean = cv::mean(rgb(kMiddle));
  EXPECT_NEAR(mean[0] / mean[1], std::sqrt(warm[0]), 0.02);
  EXPECT_NEAR(mean[2] / mean[1], std::sqrt(warm[2]), 0.02);
}

TEST(CameraLook, NoiseHasTheWishedStrengthAndChangesFromPictureToPicture) {
  Finisher finisher(sampleCamera(), 1.0);
  const cv::Mat grey(static_cast<int>(finisher.source().height), static_cast<int>(finisher.source().width),
                     CV_8UC4, cv::Scalar(120, 120, 120, 100));
  CameraLook look;
  look.noise = 5;
  finisher.setLook(look);
  cv::Mat first, second, difference;
  finisher.apply(grey, &first);
  finisher.apply(grey, &second);
  cv::subtract(first(kMiddle), second(kMiddle), difference, cv::noArray(), CV_16S);
  cv::Scalar mean, deviation;
  cv::meanStdDev(difference, mean, deviation);
  EXPECT_NEAR(deviation[0], 5 * std::sqrt(2.0), 0.8);
  EXPECT_EQ(first.at<cv::Vec3b>(0, 0), cv::Vec3b(0, 0, 0)) << "the surround stays black";
}

TEST(CameraLook, OnlyWhatIsOutOfFocusIsBlurred) {
  Finisher finisher(sampleCamera(), 1.0);
  CameraLook look;
  look.focus = 0.06;
  finisher.setLook(look);
  cv::Mat sharp, at_focus, near;
  finisher.apply(stripes(finisher, 0.06), &at_focus);
  finisher.apply(stripes(finisher, 0.015), &near);
  finisher.setLook({});
  finisher.apply(stripes(finisher, 0.015), &sharp);
  EXPECT_NEAR(contrast(at_focus, kMiddle), contrast(sharp, kMiddle), 0.5);
  EXPECT_LT(contrast(near, kMiddle), 0.6 * contrast(sharp, kMiddle));
}

}  // namespace
}  // namespace vest::picture
