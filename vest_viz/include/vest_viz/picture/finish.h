#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <opencv2/core.hpp>

#include "vest_viz/camera/model.h"
#include "vest_viz/picture/edges.h"

namespace vest::picture {

/// The round image inside the frame. Pixels.
struct Circle {
  double cx = 0, cy = 0, radius = 0;
};

/// What the camera control unit does with the picture, besides exposure.
struct CameraLook {
  double lamp = 5600;           ///< K, colour temperature of the light source (xenon: about 5600 … 6000)
  double white_balance = 5600;  ///< K that the camera takes for white
  double noise = 0;             ///< standard deviation of the sensor's noise in 8 bit levels at medium grey
  double focus = 0;             ///< m, distance in focus; 0: everything is sharp
};

/// Factors for red, green, blue of a camera that takes `white` for white under a lamp of `lamp` kelvin:
/// Planck's law at 610, 545 and 465 nm, green kept at 1. Both in K, clamped to 1500 … 20000.
std::array<double, 3> whiteBalance(double lamp, double white);

/// Condition of the front lens (vest_msgs/LensState).
struct Lens {
  double fog = 0;  ///< 0 clear … 1 blind, mean
  int columns = 0, rows = 0;
  std::vector<std::uint8_t> fogging;  ///< 0 clear … 255 blind, likewise; empty: everywhere as in `fog`
  std::vector<std::uint8_t> soiling;  ///< 0 clean … 255 opaque, row-major over the picture; may be empty
  std::vector<std::uint8_t> blood;    ///< 0 water or smoke … 255 blood, as many; may be empty
  bool clear() const { return fog < 0.005 && soiling.empty(); }
};

/// Turns the pinhole rendering into what the camera chip delivers: lens distortion, round field stop with its
/// thin bright rim, black outside. Built once per camera, no allocation afterwards.
class Finisher {
 public:
  /// @param camera  what is published: size, K, plumb_bob coefficients
  /// @param circle_share radius of the round image over half the picture's height, 0.3 … 1.5
  /// @param resolution rendered pixels per pixel of the picture, along an edge, 0.4 … 2; above 1 edges
  /// are finer, below it the camera's resampling fills in
  Finisher(const camera::Intrinsics& camera, double circle_share, double resolution = 1.0);

  /// The square pinhole camera that has to be rendered, just large enough for the circle.
  const camera::Intrinsics& source() const { return source_; }
  const Circle& circle() const { return circle_; }
  /// Radius of the circle in the rendering as share of its half width, for masking what nobody sees.
  double sourceRadius() const { return source_radius_; }

  void setLook(const CameraLook& look);
  /// Takes over a new condition of the lens; a soiling map that is not columns × rows counts as clean.
  void setLens(const Lens& lens);

  /// @param rendering CV_8UC4, RGB and depth (as ogre_media/tissue.frag codes it), source().width × height
  /// @param veil      CV_8UC4 of any size over the same field: colour and opacity of what floats in between
  ///                  (smoke::Veil); may be empty
  /// @param out       CV_8UC3, RGB, camera size; allocated on first use
  void apply(const cv::Mat& rendering, const cv::Mat& veil, cv::Mat* out);
  void apply(const cv::Mat& rendering, cv::Mat* out) { apply(rendering, {}, out); }

 private:
  /// Prepares a rendering with fewer pixels than the picture for enlarging: some sharpness back, but not at
  /// the rims of highlights. These are as hard as the rendering allows and would show its pixels as stairs;
  /// they are mixed as light, far brighter than white.
  void resample();
  void blendVeil(const cv::Mat& veil);
  void defocus();
  void cloud();
  camera::Intrinsics camera_, source_;
  Circle circle_;
  double source_radius_ = 1;
  double sharpening_ =
      0;             ///< no unit: part of what is finer than a rendered pixel's neighbours, added once more
  cv::Rect window_;  ///< of the circle in the picture
  cv::Mat map_, map_fraction_;
  cv::Mat weight_, rim_;  ///< CV_8UC3 over window_
  cv::Mat warped_, rgb_, veil_, small_, blurred_, near_white_, glare_, depth_;
  cv::Mat light_;  ///< CV_16U look-up table: levels of light that the shaders' response hides; empty unless
                   ///< enlarging
  EdgeSmoother edges_;
  cv::Mat soil_, soil_colour_;  ///< over window_: opacity, colour; empty while the lens is clean
  cv::Mat fogging_;             ///< over window_: fog of 255; empty: everywhere fog_
  cv::Mat white_;               ///< look-up table, empty while neutral
  cv::Mat noise_;               ///< a strip of noise, CV_8S, entered at another place each picture
  std::uint32_t pictures_ = 0;
  CameraLook look_;
  double fog_ = 0;
};

/// Depth in metres of the code that the shaders write into the alpha channel (0: 0.3 m or farther).
double codedDepth(std::uint8_t code);

/// Light meter of the camera control unit: holds the bright part of the picture at a wanted level.
class AutoExposure {
 public:
  /// Measures a finished picture (RGB) inside the circle and returns the gain for the next rendering.
  /// @param dt s since the last picture; the control follows with a time constant of 0.25 s (assumed; by eye)
  /// @param drawn the gain that the picture was drawn with: a worker finishes it while the next is drawn
  double update(const cv::Mat& rgb, const Circle& circle, double dt, double drawn);
  double gain() const { return gain_; }

 private:
  double gain_ = 1.0;
  int pictures_ = 0;
};

}  // namespace vest::picture
