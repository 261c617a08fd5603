#include "vest_viz/picture/check.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <stdexcept>

#include <opencv2/imgproc.hpp>

namespace vest::picture {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr int kBlack = 12;        // luminance up to which a pixel outside counts as black (JPEG noise)
constexpr double kMargin = 0.96;  // share of the radius that is measured

double quantile(std::vector<float>* values, double share) {
  if (values->empty()) return 0;
  const auto k = static_cast<std::size_t>(share * (static_cast<double>(values->size()) - 1));
  std::nth_element(values->begin(), values->begin() + static_cast<std::ptrdiff_t>(k), values->end());
  return (*values)[k];
}

/// Mean over a k × k square, of pixels inside the mask only, so that the black outside makes no contrast.
cv::Mat maskedMean(const cv::Mat& value, const cv::Mat& mask, int k) {
  cv::Mat sum, weight;
  cv::boxFilter(value.mul(mask), sum, CV_32F, {k, k}, {-1, -1}, false, cv::BORDER_CONSTANT);
  cv::boxFilter(mask, weight, CV_32F, {k, k}, {-1, -1}, false, cv::BORDER_CONSTANT);
  return sum / cv::max(weight, 1.0);
}

}  // namespace

Circle findCircle(const cv::Mat& bgr) {
  if (bgr.empty() || bgr.type() != CV_8UC3)
    throw std::invalid_argument("picture must have 8 bit and three channels");
  cv::Mat grey;
  cv::cvtColor(bgr, grey, cv::COLOR_BGR2GRAY);
  cv::Mat bright = grey > kBlack;
  cv::medianBlur(bright, bright, 3);  // single bright pixels are no border
  std::vector<cv::Point> points;
  cv::findNonZero(bright, points);
  if (points.empty()) throw std::invalid_argument("picture is black");
  const cv::Rect box = cv::boundingRect(points);
  Circle circle;
  circle.cx = box.x + 0.5 * (box.width - 1);
  circle.cy = box.y + 0.5 * (box.height - 1);
  circle.radius = 0.5 * std::max(box.width, box.height);
  return circle;
}

std::vector<Row> checkPicture(const cv::Mat& bgr, const Circle& circle) {
  if (bgr.empty() || bgr.type() != CV_8UC3)
    throw std::invalid_argument("picture must have 8 bit and three channels");
  cv::Mat grey, hsv;
  cv::cvtColor(bgr, grey, cv::COLOR_BGR2GRAY);
  cv::cvtColor(bgr, hsv, cv::COLOR_BGR2HSV);
  cv::Mat luminance, mask = cv::Mat::zeros(bgr.size(), CV_32F);
  grey.convertTo(luminance, CV_32F);
  cv::circle(mask, cv::Point(cvRound(circle.cx), cvRound(circle.cy)),
             static_cast<int>(kMargin * circle.radius), 1.0, -1);

  std::vector<float> all, saturation;
  std::vector<float> rings[5];
  double bright = 0, saturated = 0, reddish = 0, outside = 0;
  for (int y = 0; y < bgr.rows; ++y)
    for (int x = 0; x < bgr.cols; ++x) {
      const float l = luminance.at<float>(y, x);
      const double r = std::hypot(x - circle.cx, y - circle.cy) / circle.radius;
      if (r > 1.02) outside = std::max(outside, static_cast<double>(l));
      if (mask.at<float>(y, x) == 0) continue;
      all.push_back(l);
      rings[std::min(4, static_cast<int>(r / kMargin * 5))].push_back(l);
      bright += l > 230;
      const cv::Vec3b& p = hsv.at<cv::Vec3b>(y, x);  // hue in steps of 2 degrees
      saturation.push_back(p[1] / 255.0f);
      if (p[1] > 0.2 * 255) {
        ++saturated;
        reddish += p[0] >= 165 || p[0] <= 22;
      }
    }
  // Roundness: per degree the outermost pixel that is not black; directions that leave the frame first do not
  // count.
  int border = 0, border_good = 0;
  for (int degree = 0; degree < 360; ++degree) {
    const double c = std::cos(degree * CV_PI / 180), s = std::sin(degree * CV_PI / 180);
    const double xe = circle.cx + 1.04 * circle.radius * c, ye = circle.cy + 1.04 * circle.radius * s;
    const double xi = circle.cx + circle.radius * c, yi = circle.cy + circle.radius * s;
    if (xi < 1 || yi < 1 || xi > bgr.cols - 2 || yi > bgr.rows - 2) continue;
    double r = std::hypot(xe - circle.cx, ye - circle.cy);
    for (; r > 0.5 * circle.radius; r -= 0.5) {
      const int x = cvRound(circle.cx + r * c), y = cvRound(circle.cy + r * s);
      if (x >= 0 && y >= 0 && x < bgr.cols && y < bgr.rows && luminance.at<float>(y, x) > kBlack) break;
    }
    ++border;
    border_good += std::fabs(r / circle.radius - 1) < 0.015;
  }
  if (all.empty()) throw std::invalid_argument("the circle does not meet the picture");
  const double n = static_cast<double>(all.size());

  std::vector<Row> rows;
  const struct {
    double share, low, high;
  } levels[] = {{.05, 5, 25}, {.25, 25, 51}, {.50, 33, 88}, {.75, 96, 134}, {.95, 132, 212}, {.99, 160, 255}};
  for (const auto& level : levels)
    rows.push_back({"luminance at " + std::to_string(static_cast<int>(100 * level.share + 0.5)) + " %",
                    quantile(&all, level.share), level.low, level.high});
  rows.push_back({"brighter than 230, %", 100 * bright / n, 0.5, 3.5, 0.0, 3.0});
  double brightest = 1e-6, last = 0;
  for (int k = 0; k < 5; ++k) {
    last = quantile(&rings[k], 0.5);
    brightest = std::max(brightest, last);
  }
  rows.push_back({"outermost ring / brightest ring", last / brightest, 0.0, 0.65});
  rows.push_back({"hue 330..45 of saturated, %", saturated > 0 ? 100 * reddish / saturated : 0, 95, 100});
  rows.push_back({"median saturation", quantile(&saturation, 0.5), 0.3, 0.7, 0.33, 0.68});

  // Central differences, on luminance 0 … 1.
  cv::Mat gx, gy, gradient;
  const cv::Mat unit = luminance / 255.0;
  const cv::Matx13f across(-0.5f, 0, 0.5f);
  cv::filter2D(unit, gx, CV_32F, across);
  cv::filter2D(unit, gy, CV_32F, across.t());
  cv::magnitude(gx, gy, gradient);
  std::vector<float> steps;
  double sum = 0;
  for (int y = 0; y < bgr.rows; ++y)
    for (int x = 0; x < bgr.cols; ++x)
      if (mask.at<float>(y, x) != 0) {
        steps.push_back(gradient.at<float>(y, x));
        sum += steps.back();
      }
  rows.push_back({"mean gradient per pixel", sum / n, 0.018, kInfinity, 0.022, 0.043});
  rows.push_back({"gradient at 90 %", quantile(&steps, 0.9), 0.04, kInfinity, 0.048, 0.104});

  const double mean = cv::sum(luminance.mul(mask))[0] / n;
  const struct {
    const char* name;
    int inner, outer;
    double low, seen_low, seen_high;
  } bands[] = {{"contrast 1-3 px", 1, 3, 0.04, 0.045, 0.11},
               {"contrast 3-9 px", 3, 9, 0.05, 0.056, 0.118},
               {"contrast 9-27 px", 9, 27, 0.06, 0.066, 0.154}};
  for (const auto& band : bands) {
    const cv::Mat a = band.inner == 1 ? luminance : maskedMean(luminance, mask, band.inner);
    const cv::Mat difference = (a - maskedMean(luminance, mask, band.outer)).mul(mask);
    const double deviation = std::sqrt(cv::sum(difference.mul(difference))[0] / n);
    rows.push_back(
        {band.name, deviation / std::max(mean, 1e-6), band.low, kInfinity, band.seen_low, band.seen_high});
  }
  rows.push_back({"brightest outside of the circle", outside, 0, kBlack});
  rows.push_back({"round border, %", border > 0 ? 100.0 * border_good / border : 0, 95, 100});
  return rows;
}

bool allInside(const std::vector<Row>& rows) {
  return !rows.empty() && std::all_of(rows.begin(), rows.end(), [](const Row& row) { return row.inside(); });
}

std::string format(const std::vector<Row>& rows) {
  std::string text = "figure                             value      range            inside\n";
  char line[160];
  for (const Row& row : rows) {
    char range[48];
    if (std::isinf(row.high))
      std::snprintf(range, sizeof range, ">= %.4g", row.low);
    else
      std::snprintf(range, sizeof range, "%.4g ... %.4g", row.low, row.high);
    std::snprintf(line, sizeof line, "%-34s %-10.4g %-16s %s\n", row.what.c_str(), row.value, range,
                  row.inside() ? "yes" : "NO");
    text += line;
    if (!row.hasSeen()) continue;
    text.pop_back();
    const char* verdict = row.value < row.seen_low ? " (below)" : row.value > row.seen_high ? " (above)" : "";
    std::snprintf(line, sizeof line, "   eight frames %.4g ... %.4g%s\n", row.seen_low, row.seen_high,
                  verdict);
    text += line;
  }
  return text;
}

}  // namespace vest::picture
