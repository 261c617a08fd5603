#pragma once

#include <cstdint>

#include <opencv2/core.hpp>

#include "vest_viz/camera/model.h"

namespace vest::picture {

/// The round image inside the frame. Pixels.
struct Circle {
  double cx = 0, cy = 0, radius = 0;
};

/// Turns the pinhole rendering into what the camera chip delivers: lens distortion, round field stop with its
/// thin bright rim, black outside. Built once per camera, no allocation afterwards.
class Finisher {
 public:
  /// @param camera  what is published: size, K, plumb_bob coefficients
  /// @param circle_share radius of the round image over half the picture's height, 0.3 … 1.5
  /// @param resolution rendered pixels per pixel of the picture, along an edge, 0.4 … 1
  Finisher(const camera::Intrinsics& camera, double circle_share, double resolution = 1.0);

  /// The square pinhole camera that has to be rendered, just large enough for the circle.
  const camera::Intrinsics& source() const { return source_; }
  const Circle& circle() const { return circle_; }
  /// Radius of the circle in the rendering as share of its half width, for masking what nobody sees.
  double sourceRadius() const { return source_radius_; }

  /// @param rendering CV_8UC4, RGBA, source().width × height
  /// @param out       CV_8UC3, RGB, camera size; allocated on first use
  void apply(const cv::Mat& rendering, cv::Mat* out);

 private:
  camera::Intrinsics camera_, source_;
  Circle circle_;
  double source_radius_ = 1;
  cv::Rect window_;  ///< of the circle in the picture
  cv::Mat map_, map_fraction_;
  cv::Mat weight_, rim_;  ///< CV_8UC3 over window_
  cv::Mat warped_, rgb_;
};

/// Light meter of the camera control unit: holds the bright part of the picture at a wanted level.
class AutoExposure {
 public:
  /// Measures a finished picture (RGB) inside the circle and returns the gain for the next rendering.
  /// @param dt s since the last picture; the control follows with a time constant of 0.25 s (assumed; by eye)
  double update(const cv::Mat& rgb, const Circle& circle, double dt);
  double gain() const { return gain_; }

 private:
  double gain_ = 1.0;
  int pictures_ = 0;
};

}  // namespace vest::picture
