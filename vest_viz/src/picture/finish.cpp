#include "vest_viz/picture/finish.h"

#include <algorithm>
#include <cmath>

#include <opencv2/imgproc.hpp>

namespace vest::picture {
namespace {
constexpr double kRimWidth = 2.2;  // pixels at 576 lines; by eye
}

Finisher::Finisher(const camera::Intrinsics& camera, double share, double resolution) : camera_(camera) {
  share = std::clamp(share, 0.3, 1.5);
  circle_.cx = camera.cx;
  circle_.cy = camera.cy;
  circle_.radius = share * 0.5 * camera.height;
  // Farthest undistorted direction on the circle, inside the frame.
  double reach = 0;
  for (int i = 0; i < 720; ++i) {
    const double a = i * 3.14159265358979 / 360;
    const double x = std::clamp(circle_.cx + circle_.radius * std::cos(a), 0.0, camera.width - 1.0);
    const double y = std::clamp(circle_.cy + circle_.radius * std::sin(a), 0.0, camera.height - 1.0);
    const Eigen::Vector2d n = camera::unproject(camera, {x, y});
    reach = std::max(reach, n.norm());
  }
  const double half = 1.01 * reach;
  // As many pixels per edge as the circle has, so that the middle is not blurred.
  const auto edge =
      static_cast<std::uint32_t>(2 * std::ceil(circle_.radius * 1.02 * std::clamp(resolution, 0.4, 1.0)));
  source_ = camera::fromFieldOfView(edge, edge, 2 * std::atan(half), {0, 0, 0, 0, 0});
  source_radius_ = reach / half;

  const int x0 = std::max(0, static_cast<int>(circle_.cx - circle_.radius) - 2);
  const int y0 = std::max(0, static_cast<int>(circle_.cy - circle_.radius) - 2);
  const int x1 = std::min(static_cast<int>(camera.width), static_cast<int>(circle_.cx + circle_.radius) + 3);
  const int y1 = std::min(static_cast<int>(camera.height), static_cast<int>(circle_.cy + circle_.radius) + 3);
  window_ = cv::Rect(x0, y0, x1 - x0, y1 - y0);
  cv::Mat mx(window_.size(), CV_32F), my(window_.size(), CV_32F);
  weight_.create(window_.size(), CV_8UC3);
  rim_.create(window_.size(), CV_8UC3);
  const double rim = kRimWidth * camera.height / 576.0;
  for (int y = 0; y < window_.height; ++y)
    for (int x = 0; x < window_.width; ++x) {
      const double px = x + x0, py = y + y0, r = std::hypot(px - circle_.cx, py - circle_.cy);
      Eigen::Vector2d n(0, 0);
      if (r < circle_.radius + 2) n = camera::unproject(camera, {px, py});
      const Eigen::Vector2d s = camera::project(source_, n);
      mx.at<float>(y, x) = static_cast<float>(s.x());
      my.at<float>(y, x) = static_cast<float>(s.y());
      // Field stop: soft over two pixels; natural vignetting towards the edge.
      const double inside = std::clamp(circle_.radius - rim - r + 0.5, 0.0, 1.0);
      const double q = r / circle_.radius, fade = 1.0 - 0.38 * q * q * q * q;
      const auto w = static_cast<std::uint8_t>(255 * inside * fade);
      weight_.at<cv::Vec3b>(y, x) = {w, w, w};
      // The stop's polished edge catches some light, unevenly round the circle.
      const double ring =
          std::clamp(1.0 - std::fabs(r - (circle_.radius - 0.5 * rim)) / (0.5 * rim + 0.5), 0.0, 1.0);
      const double around = 0.72 + 0.28 * std::cos(std::atan2(py - circle_.cy, px - circle_.cx) * 2 + 0.7);
      const double g = 150 * ring * around;
      rim_.at<cv::Vec3b>(y, x) = {static_cast<std::uint8_t>(g), static_cast<std::uint8_t>(0.72 * g),
                                  static_cast<std::uint8_t>(0.62 * g)};
    }
  cv::convertMaps(mx, my, map_, map_fraction_, CV_16SC2);
}

void Finisher::apply(const cv::Mat& rendering, cv::Mat* out) {
  if (out->rows != static_cast<int>(camera_.height) || out->cols != static_cast<int>(camera_.width) ||
      out->type() != CV_8UC3) {
    out->create(static_cast<int>(camera_.height), static_cast<int>(camera_.width), CV_8UC3);
    out->setTo(0);
  }
  cv::cvtColor(rendering, rgb_, cv::COLOR_RGBA2RGB);
  cv::remap(rgb_, warped_, map_, map_fraction_, cv::INTER_LINEAR, cv::BORDER_REPLICATE);
  for (int y = 0; y < window_.height; ++y) {
    const std::uint8_t* a = warped_.ptr<std::uint8_t>(y);
    const std::uint8_t* w = weight_.ptr<std::uint8_t>(y);
    const std::uint8_t* r = rim_.ptr<std::uint8_t>(y);
    std::uint8_t* o = out->ptr<std::uint8_t>(y + window_.y) + 3 * window_.x;
    for (int i = 0; i < 3 * window_.width; ++i)
      o[i] = static_cast<std::uint8_t>(((a[i] * (w[i] + 1u)) >> 8) + r[i] * (255u - w[i]) / 255u);
  }
}

double AutoExposure::update(const cv::Mat& rgb, const Circle& circle, double dt) {
  int histogram[256] = {0}, count = 0;
  const double limit = 0.96 * circle.radius;
  for (int y = 1; y < rgb.rows; y += 4) {
    const double dy = y - circle.cy, half2 = limit * limit - dy * dy;
    if (half2 <= 0) continue;
    const int x0 = std::max(0, static_cast<int>(circle.cx - std::sqrt(half2)));
    const int x1 = std::min(rgb.cols, static_cast<int>(circle.cx + std::sqrt(half2)));
    const std::uint8_t* row = rgb.ptr<std::uint8_t>(y);
    for (int x = x0; x < x1; x += 4) {
      const std::uint8_t* p = row + 3 * x;
      ++histogram[(77 * p[0] + 150 * p[1] + 29 * p[2]) >> 8];
      ++count;
    }
  }
  if (count == 0) return gain_;
  int sum = 0, level = 255;
  for (; level > 0; --level)
    if ((sum += histogram[level]) > count / 4) break;
  // The 75 % level at 106, within the appearance page's 96–134, for the overview as for a close organ.
  const double wanted = 106.0;
  const double ratio = std::pow(std::clamp(wanted / std::max(level, 4), 0.25, 4.0), 2.0);
  // The first pictures settle at once, as a camera does before anybody looks.
  const double follow = ++pictures_ < 12 ? 0.6 : 1.0 - std::exp(-std::clamp(dt, 0.0, 1.0) / 0.25);
  gain_ = std::clamp(gain_ * std::pow(ratio, follow), 0.02, 50.0);
  return gain_;
}

}  // namespace vest::picture
