#include "vest_viz/camera/model.h"

#include <cmath>
#include <stdexcept>

namespace vest::camera {
namespace {
constexpr double kPi = 3.14159265358979323846;

Eigen::Vector2d distort(const Intrinsics& c, double x, double y) {
  const std::array<double, 5>& d = c.distortion;
  if (c.model == Distortion::Equidistant) {
    const double r = std::hypot(x, y), t = std::atan(r), t2 = t * t;
    const double bent = t * (1 + t2 * (d[0] + t2 * (d[1] + t2 * (d[2] + t2 * d[3]))));
    const double scale = r > 1e-9 ? bent / r : 1;
    return {x * scale, y * scale};
  }
  const double r2 = x * x + y * y;
  const double radial = 1 + r2 * (d[0] + r2 * (d[1] + r2 * d[4]));
  return {x * radial + 2 * d[2] * x * y + d[3] * (r2 + 2 * x * x),
          y * radial + d[2] * (r2 + 2 * y * y) + 2 * d[3] * x * y};
}
}  // namespace

Intrinsics fromFieldOfView(std::uint32_t width, std::uint32_t height, double fov,
                           const std::array<double, 5>& d) {
  if (!(fov > 0 && fov < kPi)) throw std::invalid_argument("field of view must lie between 0 and pi rad");
  if (width == 0 || height == 0) throw std::invalid_argument("picture size must not be 0");
  Intrinsics camera;
  camera.width = width;
  camera.height = height;
  camera.fx = camera.fy = 0.5 * width / std::tan(0.5 * fov);
  camera.cx = 0.5 * (width - 1.0);
  camera.cy = 0.5 * (height - 1.0);
  camera.distortion = d;
  return camera;
}

Eigen::Vector2d project(const Intrinsics& c, const Eigen::Vector2d& n) {
  const Eigen::Vector2d d = distort(c, n.x(), n.y());
  return {c.fx * d.x() + c.cx, c.fy * d.y() + c.cy};
}

Eigen::Vector2d unproject(const Intrinsics& c, const Eigen::Vector2d& pixel) {
  const Eigen::Vector2d wanted((pixel.x() - c.cx) / c.fx, (pixel.y() - c.cy) / c.fy);
  Eigen::Vector2d p = wanted;
  for (int i = 0; i < 20; ++i) {
    const Eigen::Vector2d error = distort(c, p.x(), p.y()) - wanted;
    if (error.squaredNorm() < 1e-24) break;
    constexpr double h = 1e-6;
    Eigen::Matrix2d J;
    J.col(0) = (distort(c, p.x() + h, p.y()) - distort(c, p.x() - h, p.y())) / (2 * h);
    J.col(1) = (distort(c, p.x(), p.y() + h) - distort(c, p.x(), p.y() - h)) / (2 * h);
    p -= J.inverse() * error;
  }
  return p;
}

Eigen::Matrix4d glProjection(const Intrinsics& c, double near, double far) {
  // Pixel (0,0) is centred half a pixel inside the picture's corner, hence + 0.5.
  Eigen::Matrix4d P = Eigen::Matrix4d::Zero();
  P(0, 0) = 2 * c.fx / c.width;
  P(0, 2) = 1 - 2 * (c.cx + 0.5) / c.width;
  P(1, 1) = 2 * c.fy / c.height;
  P(1, 2) = 2 * (c.cy + 0.5) / c.height - 1;
  P(2, 2) = -(far + near) / (far - near);
  P(2, 3) = -2 * far * near / (far - near);
  P(3, 2) = -1;
  return P;
}

}  // namespace vest::camera
