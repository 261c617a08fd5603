#pragma once

#include <array>
#include <cstdint>
#include <string>

#include <Eigen/Geometry>

namespace vest::camera {

/// plumb_bob (k1 k2 p1 p2 k3), the polynomial of Brown 1971 as documented for
/// sensor_msgs/CameraInfo and OpenCV's calib3d: x'' = x'(1 + k1 r² + k2 r⁴ + k3 r⁶) + 2 p1 x'y' + p2(r² +
/// 2x'²), …; or equidistant (k1 k2 k3 k4), Kannala & Brandt 2006 as in OpenCV's fisheye module:
/// θ = atan r, x'' = x'/r · θ(1 + k1 θ² + k2 θ⁴ + k3 θ⁶ + k4 θ⁸).
enum class Distortion : std::uint8_t { PlumbBob, Equidistant };

/// A calibrated camera as sensor_msgs/CameraInfo says it: pixels, optical frame (z forward, x right, y down).
struct Intrinsics {
  std::uint32_t width = 720;
  std::uint32_t height = 576;
  double fx = 0, fy = 0;  ///< pixels
  double cx = 0, cy = 0;  ///< pixels; the centre of the top-left pixel is (0, 0)
  Distortion model = Distortion::PlumbBob;
  std::array<double, 5> distortion{0, 0, 0, 0, 0};  ///< no unit: k1 k2 p1 p2 k3, or k1 k2 k3 k4 0
};

/// Square pixels, principal point in the middle. The field of view is that of the pinhole without distortion.
/// @param horizontal_fov rad, 0 < fov < pi; throws std::invalid_argument outside, or if a size is 0
Intrinsics fromFieldOfView(std::uint32_t width, std::uint32_t height, double horizontal_fov,
                           const std::array<double, 5>& distortion);

/// Reads a calibration file as camera_calibration writes it (YAML: image_width, image_height, camera_matrix,
/// distortion_model, distortion_coefficients).
/// @throws std::runtime_error naming file, field, value and what is allowed
Intrinsics readCalibration(const std::string& path);

/// Normalised undistorted (x/z, y/z) to pixel.
Eigen::Vector2d project(const Intrinsics& camera, const Eigen::Vector2d& normalised);
/// Pixel to normalised undistorted coordinates; Newton's method, exact to 1e-9 where the distortion is
/// one-to-one.
Eigen::Vector2d unproject(const Intrinsics& camera, const Eigen::Vector2d& pixel);

/// OpenGL projection (column vectors, clip z in -1 … 1) of the pinhole without distortion; the camera looks
/// along -z with y up, as OpenGL and OGRE want it.
/// @param near, far m
Eigen::Matrix4d glProjection(const Intrinsics& camera, double near, double far);

}  // namespace vest::camera
