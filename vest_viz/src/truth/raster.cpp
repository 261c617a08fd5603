#include "vest_viz/truth/raster.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace vest::truth {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3d;
using Eigen::Vector3f;

constexpr float kNear = 0.002f;  // m, as the drawing
constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();

}  // namespace

Raster::Raster(const camera::Intrinsics& camera, const picture::Circle& circle) : camera_(camera) {
  double reach = 0;
  rays_.assign(static_cast<std::size_t>(camera.width) * camera.height, Vector2f(kNaN, kNaN));
  for (std::uint32_t v = 0; v < camera.height; ++v)
    for (std::uint32_t u = 0; u < camera.width; ++u) {
      if (std::hypot(u - circle.cx, v - circle.cy) > circle.radius) continue;
      const Eigen::Vector2d n = camera::unproject(camera, {double(u), double(v)});
      rays_[static_cast<std::size_t>(v) * camera.width + u] = n.cast<float>();
      reach = std::max({reach, std::fabs(n.x()), std::fabs(n.y())});
    }
  // As fine in the middle as the picture; one pixel more at the border.
  pinhole_ = camera;
  pinhole_.model = camera::Distortion::PlumbBob;
  pinhole_.distortion = {0, 0, 0, 0, 0};
  pinhole_.width = static_cast<std::uint32_t>(2 * std::ceil(reach * camera.fx) + 4);
  pinhole_.height = static_cast<std::uint32_t>(2 * std::ceil(reach * camera.fy) + 4);
  pinhole_.cx = 0.5 * (pinhole_.width - 1.0);
  pinhole_.cy = 0.5 * (pinhole_.height - 1.0);
  const std::size_t n = static_cast<std::size_t>(pinhole_.width) * pinhole_.height;
  inverse_depth_.resize(n);
  seen_body_.resize(n);
  seen_triangle_.resize(n);
  hits_.resize(rays_.size());
}

void Raster::fill(const Vector3f& a, const Vector3f& b, const Vector3f& c, std::int32_t body,
                  std::uint32_t triangle) {
  const auto fx = static_cast<float>(pinhole_.fx), fy = static_cast<float>(pinhole_.fy);
  const auto cx = static_cast<float>(pinhole_.cx), cy = static_cast<float>(pinhole_.cy);
  const Vector3f* v[3] = {&a, &b, &c};
  float x[3], y[3], w[3];
  for (int k = 0; k < 3; ++k) {
    w[k] = 1.0f / v[k]->z();
    x[k] = fx * v[k]->x() * w[k] + cx;
    y[k] = fy * v[k]->y() * w[k] + cy;
  }
  const int x0 = std::max(0, static_cast<int>(std::ceil(std::min({x[0], x[1], x[2]}))));
  const int x1 = std::min(static_cast<int>(pinhole_.width) - 1,
                          static_cast<int>(std::floor(std::max({x[0], x[1], x[2]}))));
  const int y0 = std::max(0, static_cast<int>(std::ceil(std::min({y[0], y[1], y[2]}))));
  const int y1 = std::min(static_cast<int>(pinhole_.height) - 1,
                          static_cast<int>(std::floor(std::max({y[0], y[1], y[2]}))));
  if (x0 > x1 || y0 > y1) return;
  const float area = (x[1] - x[0]) * (y[2] - y[0]) - (x[2] - x[0]) * (y[1] - y[0]);
  if (std::fabs(area) < 1e-12f) return;
  const float inverse = 1.0f / area;
  // 1/z is linear over the picture.
  const float e1x = (y[2] - y[0]) * inverse, e1y = -(x[2] - x[0]) * inverse;
  const float e2x = -(y[1] - y[0]) * inverse, e2y = (x[1] - x[0]) * inverse;
  for (int py = y0; py <= y1; ++py) {
    const float dy = static_cast<float>(py) - y[0];
    const std::size_t row = static_cast<std::size_t>(py) * pinhole_.width;
    for (int px = x0; px <= x1; ++px) {
      const float dx = static_cast<float>(px) - x[0];
      const float b1 = dx * e1x + dy * e1y, b2 = dx * e2x + dy * e2y;
      if (b1 < 0 || b2 < 0 || b1 + b2 > 1) continue;
      const float near = w[0] + b1 * (w[1] - w[0]) + b2 * (w[2] - w[0]);
      const std::size_t i = row + static_cast<std::size_t>(px);
      if (near <= inverse_depth_[i]) continue;
      inverse_depth_[i] = near;
      seen_body_[i] = body;
      seen_triangle_[i] = triangle;
    }
  }
}

void Raster::rasterise(std::int32_t index, const std::vector<Body>& bodies) {
  const Body& body = bodies[static_cast<std::size_t>(index)];
  const std::vector<Vector3f>& p = camera_vertices_[static_cast<std::size_t>(index)];
  for (std::size_t t = 0; t < body.triangle_count; ++t) {
    const std::uint32_t* k = body.triangles + 3 * t;
    const Vector3f v[3] = {p[k[0]], p[k[1]], p[k[2]]};
    int behind = 0;
    bool finite = true;
    for (const Vector3f& q : v) {
      behind += q.z() < kNear;
      finite = finite && q.allFinite();
    }
    if (behind == 3 || !finite) continue;
    if (behind == 0) {
      fill(v[0], v[1], v[2], index, static_cast<std::uint32_t>(t));
      continue;
    }
    // Cut off what lies before the near plane.
    Vector3f kept[4];
    int n = 0;
    for (int i = 0; i < 3; ++i) {
      const Vector3f &a = v[i], &b = v[(i + 1) % 3];
      const bool in_a = a.z() >= kNear, in_b = b.z() >= kNear;
      if (in_a) kept[n++] = a;
      if (in_a != in_b) kept[n++] = a + (b - a) * ((kNear - a.z()) / (b.z() - a.z()));
    }
    for (int i = 2; i < n; ++i) fill(kept[0], kept[i - 1], kept[i], index, static_cast<std::uint32_t>(t));
  }
}

bool Raster::cut(std::int32_t body, std::uint32_t triangle, const Vector3d& ray, double slack,
                 Hit* hit) const {
  const auto& p = camera_vertices_[static_cast<std::size_t>(body)];
  const std::uint32_t* k = bodies_[static_cast<std::size_t>(body)].triangles + 3 * triangle;
  const Vector3d a = p[k[0]].cast<double>(), e1 = p[k[1]].cast<double>() - a, e2 = p[k[2]].cast<double>() - a;
  // Möller and Trumbore 1997 with the eye at the origin.
  const Vector3d h = ray.cross(e2);
  const double det = e1.dot(h);
  if (std::fabs(det) < 1e-18) return false;
  const double w1 = -a.dot(h) / det;
  const Vector3d q = (-a).cross(e1);
  const double w2 = ray.dot(q) / det;
  const double z = e2.dot(q) / det;  // the ray has length 1 along the optical axis
  if (w1 < -slack || w2 < -slack || w1 + w2 > 1 + slack || z < kNear) return false;
  hit->body = body;
  hit->triangle = triangle;
  hit->depth = static_cast<float>(z);
  hit->w1 = static_cast<float>(w1);
  hit->w2 = static_cast<float>(w2);
  return true;
}

void Raster::draw(const std::vector<Body>& bodies, const Eigen::Isometry3d& X_WO) {
  bodies_ = bodies;
  const Eigen::Isometry3d X_OW = X_WO.inverse();
  const Eigen::Matrix3f R = X_OW.linear().cast<float>();
  // Relative to the camera in double, so that places far from the world's origin keep their digits.
  camera_vertices_.resize(bodies.size());
  for (std::size_t b = 0; b < bodies.size(); ++b) {
    camera_vertices_[b].resize(bodies[b].vertices);
    for (std::size_t i = 0; i < bodies[b].vertices; ++i) {
      const float* p = bodies[b].positions + 3 * i;
      const Vector3d d = Vector3d(p[0], p[1], p[2]) - X_WO.translation();
      camera_vertices_[b][i] = R * d.cast<float>();
    }
  }
  std::fill(inverse_depth_.begin(), inverse_depth_.end(), 0.0f);
  std::fill(seen_body_.begin(), seen_body_.end(), -1);
  for (std::size_t b = 0; b < bodies.size(); ++b) rasterise(static_cast<std::int32_t>(b), bodies);
  for (std::size_t i = 0; i < rays_.size(); ++i) {
    Hit& hit = hits_[i];
    hit.body = -1;
    const Vector2f& n = rays_[i];
    if (!std::isfinite(n.x())) continue;
    const double sx = pinhole_.fx * n.x() + pinhole_.cx, sy = pinhole_.fy * n.y() + pinhole_.cy;
    const int x = static_cast<int>(sx), y = static_cast<int>(sy);
    if (x < 0 || y < 0 || x + 1 >= static_cast<int>(pinhole_.width) ||
        y + 1 >= static_cast<int>(pinhole_.height))
      continue;
    const Vector3d ray(n.x(), n.y(), 1);
    const std::size_t at = static_cast<std::size_t>(y) * pinhole_.width + static_cast<std::size_t>(x);
    const std::size_t corners[4] = {at, at + 1, at + pinhole_.width, at + pinhole_.width + 1};
    for (int c = 0; c < 4; ++c) {
      const std::int32_t body = seen_body_[corners[c]];
      if (body < 0) continue;
      bool again = false;
      for (int d = 0; d < c; ++d)
        again = again ||
                (seen_body_[corners[d]] == body && seen_triangle_[corners[d]] == seen_triangle_[corners[c]]);
      if (again) continue;
      Hit next;
      if (cut(body, seen_triangle_[corners[c]], ray, 1e-6, &next) && (hit.body < 0 || next.depth < hit.depth))
        hit = next;
    }
    if (hit.body >= 0) continue;
    // None of them holds the ray (a sliver in between, or the silhouette): the nearest pixel's, extended.
    const int rx = sx - x < 0.5 ? 0 : 1, ry = sy - y < 0.5 ? 0 : 1;
    const std::size_t nearest = corners[2 * ry + rx];
    if (seen_body_[nearest] >= 0) cut(seen_body_[nearest], seen_triangle_[nearest], ray, 1e9, &hit);
  }
}

void Raster::depth(cv::Mat* out) const {
  out->create(static_cast<int>(camera_.height), static_cast<int>(camera_.width), CV_32F);
  auto* p = out->ptr<float>();
  for (std::size_t i = 0; i < hits_.size(); ++i) p[i] = hits_[i].body < 0 ? kNaN : hits_[i].depth;
}

void Raster::segmentation(cv::Mat* out) const {
  out->create(static_cast<int>(camera_.height), static_cast<int>(camera_.width), CV_16U);
  auto* p = out->ptr<std::uint16_t>();
  for (std::size_t i = 0; i < hits_.size(); ++i)
    p[i] = hits_[i].body < 0 ? kBackground : bodies_[static_cast<std::size_t>(hits_[i].body)].label;
}

void Raster::flow(const Eigen::Isometry3d& X_WO_before, cv::Mat* out) const {
  out->create(static_cast<int>(camera_.height), static_cast<int>(camera_.width), CV_32FC2);
  const Eigen::Matrix3d R = X_WO_before.linear().transpose();
  for (std::uint32_t v = 0; v < camera_.height; ++v) {
    auto* row = out->ptr<cv::Vec2f>(static_cast<int>(v));
    for (std::uint32_t u = 0; u < camera_.width; ++u) {
      const Hit& hit = hits_[static_cast<std::size_t>(v) * camera_.width + u];
      row[u] = {kNaN, kNaN};
      if (hit.body < 0) continue;
      const Body& body = bodies_[static_cast<std::size_t>(hit.body)];
      if (body.previous == nullptr) continue;
      const std::uint32_t* k = body.triangles + 3 * hit.triangle;
      const double w[3] = {1.0 - hit.w1 - hit.w2, hit.w1, hit.w2};
      Vector3d p = Vector3d::Zero();
      for (int c = 0; c < 3; ++c)
        for (int d = 0; d < 3; ++d)
          p[d] += w[c] * body.previous[3 * static_cast<std::size_t>(k[c]) + static_cast<std::size_t>(d)];
      const Vector3d q = R * (p - X_WO_before.translation());
      if (!(q.z() > kNear)) continue;
      const Eigen::Vector2d before = camera::project(camera_, {q.x() / q.z(), q.y() / q.z()});
      row[u] = {static_cast<float>(u - before.x()), static_cast<float>(v - before.y())};
    }
  }
}

float Raster::depthAt(double u, double v) const {
  const auto x = static_cast<std::int64_t>(std::lround(u)), y = static_cast<std::int64_t>(std::lround(v));
  if (x < 0 || y < 0 || x >= camera_.width || y >= camera_.height) return kNaN;
  const Hit& hit = hits_[static_cast<std::size_t>(y * camera_.width + x)];
  return hit.body < 0 ? kNaN : hit.depth;
}

std::uint16_t Raster::labelAt(double u, double v) const {
  const auto x = static_cast<std::int64_t>(std::lround(u)), y = static_cast<std::int64_t>(std::lround(v));
  if (x < 0 || y < 0 || x >= camera_.width || y >= camera_.height) return kBackground;
  const Hit& hit = hits_[static_cast<std::size_t>(y * camera_.width + x)];
  return hit.body < 0 ? kBackground : bodies_[static_cast<std::size_t>(hit.body)].label;
}

}  // namespace vest::truth
