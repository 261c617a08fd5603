#include "vest_viz/volume/section.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>
#include <Eigen/LU>

namespace vest::volume {
namespace {

using Eigen::Vector3d;

/// Where a plane meets the edges of the block.
std::vector<Vector3d> corners(const Brick& brick, const Vector3d& normal, double offset) {
  const auto corner = [&](int c) {
    Vector3d grid;
    for (int a = 0; a < 3; ++a) grid[a] = (c >> a & 1) != 0 ? brick.size[a] - 0.5 : -0.5;
    return Vector3d(brick.origin + brick.axes * grid);
  };
  std::vector<Vector3d> found;
  for (int c = 0; c < 8; ++c)
    for (int a = 0; a < 3; ++a) {
      if ((c >> a & 1) != 0) continue;
      const Vector3d p = corner(c), q = corner(c | 1 << a);
      const double low = normal.dot(p) - offset, high = normal.dot(q) - offset;
      if (low * high <= 0 && low != high) found.push_back(p + low / (low - high) * (q - p));
    }
  return found;
}

}  // namespace

std::uint8_t grey(double value, const Window& window) {
  const double share = window.width > 1 ? (value - (window.level - 0.5)) / (window.width - 1) + 0.5
                                        : (value > window.level - 0.5 ? 1.0 : 0.0);
  return static_cast<std::uint8_t>(255 * std::min(std::max(share, 0.0), 1.0) + 0.5);
}

Section section(const Brick& brick, const inspect::Plane& plane, const Window& window, int most) {
  Section s;
  const Vector3d normal = plane.normal.cast<double>().normalized();
  const auto points = corners(brick, normal, plane.offset);
  if (points.size() < 3) return s;
  // To the right as far as that is level, and up (or away, in level planes).
  const Vector3d up = std::abs(normal.z()) < 0.9 ? Vector3d::UnitZ() : Vector3d::UnitY();
  const Vector3d right = up.cross(normal).normalized(), down = right.cross(normal);
  Eigen::Vector2d low = Eigen::Vector2d::Constant(1e300), high = -low;
  for (const Vector3d& p : points) {
    const Eigen::Vector2d at(right.dot(p), down.dot(p));
    low = low.cwiseMin(at), high = high.cwiseMax(at);
  }
  const Eigen::Vector2d extent = high - low;
  const double pixel = std::max(brick.axes.colwise().norm().minCoeff(), extent.maxCoeff() / most);
  s.width = std::clamp(static_cast<int>(std::ceil(extent.x() / pixel - 1e-9)), 1, most);
  s.height = std::clamp(static_cast<int>(std::ceil(extent.y() / pixel - 1e-9)), 1, most);
  s.corner = plane.offset * normal + low.x() * right + low.y() * down;
  s.right = extent.x() / s.width * right, s.down = extent.y() / s.height * down;
  s.rgba.assign(4 * static_cast<std::size_t>(s.width) * static_cast<std::size_t>(s.height), 0);
  const Eigen::Matrix3d inverse = brick.axes.inverse();
  const Vector3d start = inverse * (s.corner + 0.5 * s.right + 0.5 * s.down - brick.origin);
  const Vector3d column = inverse * s.right, row = inverse * s.down;
  std::uint8_t* pixels = s.rgba.data();
  for (int y = 0; y < s.height; ++y)
    for (int x = 0; x < s.width; ++x, pixels += 4) {
      const Eigen::Vector3f at = (start + x * column + y * row).cast<float>();
      bool inside = true;
      for (int a = 0; a < 3; ++a)
        inside = inside && at[a] >= -0.5f && at[a] <= static_cast<float>(brick.size[a]) - 0.5f;
      float number = 0;
      if (!inside || !interpolate(brick, at, number)) continue;
      pixels[0] = pixels[1] = pixels[2] = grey(brick.intercept + brick.slope * number, window);
      pixels[3] = 255;
    }
  return s;
}

}  // namespace vest::volume
