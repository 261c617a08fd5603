#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <numeric>
#include <stdexcept>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "vest_viz/picture/check.h"
#include "vest_viz/picture/read.h"

namespace vest::picture {
namespace {

constexpr int kWidth = 720, kHeight = 576;
constexpr double kRadius = 286;

/// Multi-scale noise whose ranks are given the levels of a real picture: inside every range by construction.
/// @param falloff how much darker than the middle the edge is
cv::Mat goodPicture(double falloff = 1.6) {
  cv::RNG random(7);
  cv::Mat score = cv::Mat::zeros(kHeight, kWidth, CV_32F);
  for (int sigma : {0, 1, 2, 4, 8, 16}) {
    cv::Mat noise(kHeight, kWidth, CV_32F);
    random.fill(noise, cv::RNG::NORMAL, 0, 1);
    if (sigma > 0) cv::GaussianBlur(noise, noise, {0, 0}, sigma);
    cv::Scalar mean, deviation;
    cv::meanStdDev(noise, mean, deviation);
    score += noise * ((sigma < 2 ? 0.12 : 0.3) / deviation[0]);
  }
  std::vector<int> inside;
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      const double r = std::hypot(x - 359.5, y - 287.5) / kRadius;
      score.at<float>(y, x) -= static_cast<float>(falloff * r * r);
      if (r <= 1) inside.push_back(y * kWidth + x);
    }
  std::sort(inside.begin(), inside.end(), [&](int a, int b) {
    return score.at<float>(a / kWidth, a % kWidth) < score.at<float>(b / kWidth, b % kWidth);
  });
  const double share[] = {0, 0.05, 0.25, 0.5, 0.75, 0.95, 0.985, 1},
               level[] = {14, 17, 38, 60, 112, 175, 233, 255};
  cv::Mat picture = cv::Mat::zeros(kHeight, kWidth, CV_8UC3);
  for (std::size_t i = 0; i < inside.size(); ++i) {
    const double q = static_cast<double>(i) / (static_cast<double>(inside.size()) - 1);
    std::size_t k = 0;
    while (k + 2 < std::size(share) && q > share[k + 1]) ++k;
    const double l = level[k] + (level[k + 1] - level[k]) * (q - share[k]) / (share[k + 1] - share[k]);
    // Half saturated red; where red would overflow the rest becomes white.
    double red = l / 0.6495, other = 0.5 * red;
    if (red > 255) red = 255, other = (l - 0.299 * 255) / 0.701;
    const auto o = static_cast<std::uint8_t>(std::lround(std::clamp(other, 0.0, 255.0)));
    picture.at<cv::Vec3b>(inside[i] / kWidth, inside[i] % kWidth) = {
        o, o, static_cast<std::uint8_t>(std::lround(red))};
  }
  return picture;
}

std::vector<Row> check(const cv::Mat& picture) {
  return checkPicture(picture, findCircle(picture));
}

bool inside(const std::vector<Row>& rows, const std::string& what) {
  for (const Row& row : rows)
    if (row.what.rfind(what, 0) == 0) return row.inside();
  ADD_FAILURE() << "no row " << what;
  return true;
}

TEST(CheckPicture, CircleIsFoundWhereItIs) {
  const Circle circle = findCircle(goodPicture());
  EXPECT_NEAR(circle.cx, 359.5, 1);
  EXPECT_NEAR(circle.cy, 287.5, 1);
  EXPECT_NEAR(circle.radius, kRadius, 2);
}

TEST(CheckPicture, CircleCutOffAboveAndBelowIsFoundByItsWidth) {
  cv::Mat picture = cv::Mat::zeros(342, 604, CV_8UC3);
  cv::circle(picture, {302, 171}, 220, {60, 60, 120}, -1);
  EXPECT_NEAR(findCircle(picture).radius, 220, 2);
}

TEST(CheckPicture, PictureMadeInsideAllRangesPasses) {
  const auto rows = check(goodPicture());
  EXPECT_TRUE(allInside(rows)) << format(rows);
}

struct Doctored {
  const char* row;
  std::function<cv::Mat(cv::Mat)> change;
};

class EachRow : public testing::TestWithParam<Doctored> {};

TEST_P(EachRow, FailsOnAPictureDoctoredAgainstIt) {
  const auto rows = check(GetParam().change(goodPicture()));
  EXPECT_FALSE(inside(rows, GetParam().row)) << format(rows);
  EXPECT_FALSE(allInside(rows));
}

cv::Mat scaled(const cv::Mat& p, double gain, double offset) {
  cv::Mat out, mask;
  p.convertTo(out, -1, gain, offset);
  cv::inRange(p, cv::Scalar(0, 0, 0), cv::Scalar(0, 0, 0), mask);
  out.setTo(0, mask);
  return out;
}
cv::Mat swapped(const cv::Mat& p) {
  cv::Mat out;
  cv::cvtColor(p, out, cv::COLOR_BGR2RGB);
  return out;
}
cv::Mat grey(const cv::Mat& p) {
  cv::Mat one, out;
  cv::cvtColor(p, one, cv::COLOR_BGR2GRAY);
  cv::cvtColor(one, out, cv::COLOR_GRAY2BGR);
  return out;
}
cv::Mat blurred(const cv::Mat& p) {
  cv::Mat out;
  cv::GaussianBlur(p, out, {0, 0}, 20);
  return out;
}
cv::Mat withoutHighlights(const cv::Mat& p) {
  return cv::min(p, cv::Scalar(200, 200, 255));
}
cv::Mat withCorner(cv::Mat p) {
  cv::rectangle(p, {0, 0, 30, 30}, {40, 40, 90}, -1);
  return p;
}
cv::Mat squashed(const cv::Mat& p) {
  cv::Mat small, out = cv::Mat::zeros(p.size(), p.type());
  cv::resize(p, small, {kWidth, 480});
  small.copyTo(out(cv::Rect(0, 48, kWidth, 480)));
  return out;
}

INSTANTIATE_TEST_SUITE_P(
    Rows, EachRow,
    testing::Values(Doctored{"luminance at 5 %", [](cv::Mat p) { return scaled(p, 1, 30); }},
                    Doctored{"luminance at 25 %", [](cv::Mat p) { return scaled(p, 0.5, 0); }},
                    Doctored{"luminance at 50 %", [](cv::Mat p) { return scaled(p, 1, 40); }},
                    Doctored{"luminance at 75 %", [](cv::Mat p) { return scaled(p, 0.7, 0); }},
                    Doctored{"luminance at 95 %", [](cv::Mat p) { return scaled(p, 0.6, 0); }},
                    Doctored{"luminance at 99 %", [](cv::Mat p) { return scaled(p, 0.5, 0); }},
                    Doctored{"brighter than 230", withoutHighlights},
                    Doctored{"outermost ring", [](cv::Mat) { return goodPicture(0.0); }},
                    Doctored{"hue", swapped}, Doctored{"hue", grey}, Doctored{"median saturation", grey},
                    Doctored{"mean gradient", blurred}, Doctored{"gradient at 90", blurred},
                    Doctored{"contrast 1-3", blurred}, Doctored{"contrast 3-9", blurred},
                    Doctored{"contrast 9-27", [](cv::Mat p) { return blurred(blurred(blurred(p))); }},
                    Doctored{"brightest outside", withCorner}, Doctored{"round border", squashed}));

// The eight frames show neither smoke nor fog. Both veil: they lift what is black and take contrast and
// glare.
bool veiled(const std::string& picture, const std::string& row) {
  if (picture.rfind("view_smoke", 0) != 0 && picture.rfind("view_lens", 0) != 0) return false;
  for (const char* what : {"luminance at 5 %", "brighter than 230", "outermost ring", "gradient"})
    if (row.find(what) != std::string::npos) return true;
  return false;
}

TEST(Gallery, EveryPictureOfTheEndoscopicViewLiesInsideTheFigures) {
  int pictures = 0;
  for (const auto& entry : std::filesystem::directory_iterator(VEST_VIZ_GALLERY)) {
    const std::string name = entry.path().filename();
    if (name.rfind("view_", 0) != 0 && name.rfind("scene_", 0) != 0) continue;
    const cv::Mat picture = cv::imread(entry.path());
    const std::vector<Row> rows = checkPicture(picture, findCircle(picture));
    for (const Row& row : rows)
      EXPECT_TRUE(row.inside() || veiled(name, row.what)) << name << "\n" << format(rows);
    ++pictures;
  }
  EXPECT_GE(pictures, 15);
}

TEST(CheckPicture, WhatIsNoPictureIsRefused) {
  EXPECT_THROW(findCircle({}), std::invalid_argument);
  EXPECT_THROW(findCircle(cv::Mat::zeros(100, 100, CV_8UC3)), std::invalid_argument);
  EXPECT_THROW(findCircle(cv::Mat::zeros(100, 100, CV_8UC1)), std::invalid_argument);
}

std::string refusal(const std::string& file) {
  testing::internal::CaptureStderr();
  std::string message;
  try {
    read(file, cv::IMREAD_COLOR);
  } catch (const std::runtime_error& error) {
    message = error.what();
  }
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "") << "the codec's own words beside ours";
  return message;
}

TEST(ReadPicture, WhatIsNoPictureOrATooLargeOneIsRefusedByName) {
  const std::string folder = testing::TempDir() + "vest_read_picture_" + std::to_string(getpid());
  std::filesystem::create_directories(folder);
  for (const char* const ending : {".png", ".jpg"}) {
    std::vector<unsigned char> whole;
    ASSERT_TRUE(cv::imencode(ending, goodPicture(), whole));
    const std::string file = folder + "/a" + ending;
    const auto write = [&](const std::vector<unsigned char>& bytes) {
      std::ofstream(file, std::ios::binary)
          .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
    };
    write(whole);
    EXPECT_EQ(refusal(file), "");
    EXPECT_EQ(read(file, cv::IMREAD_COLOR).size(), cv::Size(kWidth, kHeight));
    for (const std::size_t bytes : {std::size_t{0}, std::size_t{1}, std::size_t{11}, std::size_t{20}}) {
      write({whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(bytes)});
      EXPECT_EQ(refusal(file).rfind(file + ": no PNG or JPEG picture", 0), 0u) << bytes << refusal(file);
    }
    // The header's size: 65,535 pixels along both axes.
    const std::vector<unsigned char> start{0xff, 0xc0};
    const bool png = ending[1] == 'p';
    const auto at =
        png ? whole.begin() + 16 : std::search(whole.begin(), whole.end(), start.begin(), start.end()) + 5;
    std::vector<unsigned char> huge = whole;
    for (const int i : {0, 1, 2, 3})
      huge[static_cast<std::size_t>(at - whole.begin() + (png ? 2 + i % 2 + i / 2 * 4 : i))] = 0xff;
    write(huge);
    EXPECT_EQ(refusal(file).rfind(file + ": too large", 0), 0u) << refusal(file);
    write(whole);
    EXPECT_THROW(read(file, cv::IMREAD_COLOR, 0), std::runtime_error)
        << "more pixels than who reads asks for";
    if (png) continue;
    // A marker that has no length leads to another place where one is read.
    huge.insert(huge.begin() + 2, {0xff, 0x01, 0xff, 0xd3});
    write(huge);
    EXPECT_EQ(refusal(file).rfind(file + ": too large", 0), 0u) << refusal(file);
    // Each scan goes over all of the picture: a file of a few bytes for each took minutes.
    std::vector<unsigned char> scans = whole;
    for (int i = 0; i < 100; ++i) scans.insert(scans.end() - 2, {0xff, 0xda, 0, 8, 1, 1, 0, 1, 63, 0, 0});
    write(scans);
    EXPECT_EQ(refusal(file).rfind(file + ": 101 scans", 0), 0u) << refusal(file);
  }
  const std::string pipe = folder + "/pipe.png";
  ASSERT_EQ(0, mkfifo(pipe.c_str(), 0600));
  EXPECT_EQ(refusal(pipe).rfind(pipe + ": a pipe", 0), 0u);
  std::vector<unsigned char> cut;
  ASSERT_TRUE(cv::imencode(".png", goodPicture(), cut));
  const std::string file = folder + "/cut.png";
  std::ofstream(file, std::ios::binary).write(reinterpret_cast<const char*>(cut.data()), 1000);
  EXPECT_EQ(refusal(file).rfind(file + ": a damaged picture", 0), 0u) << refusal(file);
  std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace vest::picture
