#include "vest_bringup/learning/painter.h"

#include <algorithm>
#include <cmath>

namespace vest::learning {
namespace {

constexpr float kNear = 0.005f;   // m: nearer triangles are left out
constexpr float kBright = 0.09f;  // m: at this distance the light is as bright as the colour says
constexpr float kEdge =
    -1e-4f;  // of a triangle: neighbours overlap by it, so that no pixel falls between them
constexpr float kAmbient = 0.12f, kDiffuse = 0.95f;
constexpr int kAround = 10;  // sides of a rod

}  // namespace

void Painter::begin(const Eigen::Isometry3d& camera, double field_of_view, int width, int height,
                    std::uint8_t* rgb, float* depth) {
  world_to_camera_ = camera.inverse().cast<float>();
  width_ = width, height_ = height;
  focal_ = static_cast<float>(0.5 * width / std::tan(0.5 * field_of_view));
  rgb_ = rgb, depth_ = depth;
  const auto pixels = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  std::fill_n(rgb, 3 * pixels, std::uint8_t{0});
  std::fill_n(depth, pixels, 0.0f);
}

/// Lambert's law under a lamp at the camera, which fades with the square of the distance, near by less.
float Painter::light(const Eigen::Vector3f& at, const Eigen::Vector3f& normal) const {
  const float far = at.norm(), size = normal.norm();
  if (!(size > 0) || !(far > 0)) return 0;
  const float fade = 2 * kBright * kBright / (kBright * kBright + far * far);
  return kAmbient + kDiffuse * std::fabs(normal.dot(at)) / (size * far) * fade;
}

void Painter::mesh(const std::vector<float>& xyz, const std::vector<std::array<std::uint32_t, 3>>& triangles,
                   const std::vector<std::uint8_t>& alive, Colour colour) {
  const std::size_t count = xyz.size() / 3;
  corners_.resize(count);
  normals_.assign(count, Eigen::Vector3f::Zero());
  for (std::size_t k = 0; k < count; ++k)
    corners_[k].at = world_to_camera_ * Eigen::Map<const Eigen::Vector3f>(xyz.data() + 3 * k);
  const auto living = [&](std::size_t i) {
    const auto& t = triangles[i];
    return (i >= alive.size() || alive[i] != 0) && std::max({t[0], t[1], t[2]}) < count;
  };
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    if (!living(i)) continue;
    const auto& t = triangles[i];
    const Eigen::Vector3f& a = corners_[t[0]].at;
    const Eigen::Vector3f normal = (corners_[t[1]].at - a).cross(corners_[t[2]].at - a);
    for (const std::uint32_t k : t) normals_[k] += normal;
  }
  for (std::size_t k = 0; k < count; ++k) corners_[k].light = light(corners_[k].at, normals_[k]);
  for (std::size_t i = 0; i < triangles.size(); ++i)
    if (living(i))
      triangle(corners_[triangles[i][0]], corners_[triangles[i][1]], corners_[triangles[i][2]], colour);
}

void Painter::rod(const Eigen::Vector3d& from, const Eigen::Vector3d& to, double radius, Colour colour) {
  const Eigen::Vector3f a = world_to_camera_ * from.cast<float>(), b = world_to_camera_ * to.cast<float>();
  const Eigen::Vector3f axis = (b - a).normalized();
  if (!axis.allFinite() || axis.squaredNorm() < 0.5f) return;
  const Eigen::Vector3f side = axis.unitOrthogonal(), up = axis.cross(side);
  // In pieces: what begins behind the eye is left out, the rest is there.
  const int pieces = std::max(1, static_cast<int>(std::ceil((b - a).norm() / 0.01f)));
  const auto corner = [&](int piece, int k) {
    const auto angle = static_cast<float>(2 * M_PI * k / kAround);
    const Eigen::Vector3f out = std::cos(angle) * side + std::sin(angle) * up;
    const Eigen::Vector3f at = a + (b - a) * (static_cast<float>(piece) / static_cast<float>(pieces)) +
                               static_cast<float>(radius) * out;
    return Corner{at, light(at, out)};
  };
  for (int p = 0; p < pieces; ++p)
    for (int k = 0; k < kAround; ++k) {
      const Corner c00 = corner(p, k), c01 = corner(p, k + 1), c10 = corner(p + 1, k),
                   c11 = corner(p + 1, k + 1);
      triangle(c00, c01, c11, colour), triangle(c00, c11, c10, colour);
    }
  for (const int end : {0, pieces})
    for (int k = 1; k + 1 < kAround; ++k) {
      Corner c[] = {corner(end, 0), corner(end, k), corner(end, k + 1)};
      for (Corner& one : c) one.light = light(one.at, axis);
      triangle(c[0], c[1], c[2], colour);
    }
}

/// Nearest wins; depth and light are linear over the triangle in space (1/z is over the picture).
void Painter::triangle(const Corner& a, const Corner& b, const Corner& c, Colour colour) {
  if (std::min({a.at.z(), b.at.z(), c.at.z()}) < kNear) return;
  const auto place = [&](const Corner& p) {
    const float scale = focal_ / p.at.z();
    return Eigen::Vector2f(p.at.x() * scale + 0.5f * static_cast<float>(width_),
                           p.at.y() * scale + 0.5f * static_cast<float>(height_));
  };
  const Eigen::Vector2f pa = place(a), pb = place(b), pc = place(c);
  const float area = (pb - pa).x() * (pc - pa).y() - (pb - pa).y() * (pc - pa).x();
  if (!std::isfinite(area) || area == 0) return;
  const auto first = [](float low, int most) {
    return static_cast<int>(std::clamp(std::floor(low), 0.0f, static_cast<float>(most)));
  };
  const auto last = [](float high, int most) {
    return static_cast<int>(std::clamp(std::ceil(high) + 1, 0.0f, static_cast<float>(most)));
  };
  const int x0 = first(std::min({pa.x(), pb.x(), pc.x()}), width_),
            x1 = last(std::max({pa.x(), pb.x(), pc.x()}), width_),
            y0 = first(std::min({pa.y(), pb.y(), pc.y()}), height_),
            y1 = last(std::max({pa.y(), pb.y(), pc.y()}), height_);
  const float ia = 1 / a.at.z(), ib = 1 / b.at.z(), ic = 1 / c.at.z();
  for (int y = y0; y < y1; ++y)
    for (int x = x0; x < x1; ++x) {
      const Eigen::Vector2f p(static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f);
      const float u = ((pb - p).x() * (pc - p).y() - (pb - p).y() * (pc - p).x()) / area;
      const float v = ((pc - p).x() * (pa - p).y() - (pc - p).y() * (pa - p).x()) / area;
      const float w = 1 - u - v;
      if (std::min({u, v, w}) < kEdge) continue;
      const float z = 1 / (u * ia + v * ib + w * ic);
      const std::size_t i =
          static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(x);
      if (depth_[i] > 0 && depth_[i] <= z) continue;
      depth_[i] = z;
      const float bright = z * (u * ia * a.light + v * ib * b.light + w * ic * c.light);
      for (std::size_t channel = 0; channel < 3; ++channel)
        rgb_[3 * i + channel] =
            static_cast<std::uint8_t>(std::min(255.0f, bright * static_cast<float>(colour[channel])));
    }
}

}  // namespace vest::learning
