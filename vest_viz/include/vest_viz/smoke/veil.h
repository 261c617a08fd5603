#pragma once

#include <cstdint>
#include <vector>

#include <Eigen/Geometry>
#include <opencv2/core.hpp>

#include "vest_viz/camera/model.h"

namespace vest::smoke {

/// Density of smoke on a regular grid, as vest_msgs/SmokeState.
struct Field {
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();  ///< m, world: corner
  double cell = 0;                                   ///< m
  std::uint32_t size[3] = {0, 0, 0};                 ///< cells in x, y, z
  float scale = 0;                                   ///< kg/m3 per 255
  std::vector<std::uint8_t> density;                 ///< x fastest
  /// False if the numbers contradict each other or are not finite.
  bool valid() const;
};

/// Smoke between lens and tissue (a 3-D density field): rays are
/// marched through the field on a coarse grid of the picture, up to the depth that the rendering coded into
/// its alpha channel. Single scattering of the light at the lens, whose strength falls with the square of the
/// distance; Beer-Lambert with effects::kSmokeExtinction. No allocation after the first picture of a size.
class Veil {
 public:
  Veil();
  /// @param source    the pinhole camera of the rendering; @param X_WO its optical frame in world
  /// @param rendering CV_8UC4 with coded depth; @param time s, moves the turbulence
  /// @param light     lamp's intensity times exposure, m2, as in the shaders
  /// @param out       CV_8UC4: RGB and opacity, 1/8 of the source's size; empty where the field is invalid or
  ///                  holds nothing that could be seen
  void draw(const Field& field, const camera::Intrinsics& source, const Eigen::Isometry3d& X_WO,
            const cv::Mat& rendering, double time, double light, cv::Mat* out);

 private:
  std::vector<std::uint8_t> noise_;  ///< turbulence, a cube that tiles
};

}  // namespace vest::smoke
