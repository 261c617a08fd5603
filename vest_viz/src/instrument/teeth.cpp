#include "vest_viz/instrument/teeth.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include <Eigen/Geometry>

namespace vest::instrument {
namespace {

constexpr float kDeepest = 0.00036f;                  // m: teeth of make_meshes.cpp, at most 0.35 mm
constexpr float kAlong = 0.0005f, kAcross = 0.0006f;  // m: a tooth to either side; the width of a bar
constexpr double kPitch = 0.0005;                     // m: of the finest teeth there
constexpr double kNone = 3, kAll = 6;  // pixels a tooth: at three each has a shade by chance (by eye)

}  // namespace

TriangleMesh toothless(const TriangleMesh& jaw) {
  TriangleMesh out = jaw;
  const std::size_t count = jaw.positions.size() / 3;
  const auto at = [&](std::size_t v) { return Eigen::Vector3f::Map(jaw.positions.data() + 3 * v); };
  for (std::size_t v = 0; v < count; ++v) {
    const Eigen::Vector3f here = at(v);
    if (std::fabs(here.x()) > kDeepest) continue;
    float crest = here.x();
    for (std::size_t w = 0; w < count; ++w) {
      const Eigen::Vector3f there = at(w);
      if (std::fabs(there.z() - here.z()) > kAlong || std::fabs(there.y() - here.y()) > kAcross) continue;
      if (std::fabs(there.x()) < std::fabs(crest)) crest = there.x();
    }
    out.positions[3 * v] = crest;
  }
  std::fill(out.normals.begin(), out.normals.end(), 0.0f);
  const auto place = [&](std::size_t v) { return Eigen::Vector3f::Map(out.positions.data() + 3 * v); };
  const auto normal = [&](std::size_t v) { return Eigen::Map<Eigen::Vector3f>(out.normals.data() + 3 * v); };
  for (std::size_t i = 0; i < out.triangles.size(); i += 3) {
    const std::size_t a = out.triangles[i], b = out.triangles[i + 1], c = out.triangles[i + 2];
    const Eigen::Vector3f area = (place(b) - place(a)).cross(place(c) - place(a));
    for (const std::size_t v : {a, b, c}) normal(v) += area;
  }
  for (std::size_t v = 0; v < count; ++v) {
    const float length = normal(v).norm();
    // A triangle without area has none: that of the tooth is as good.
    if (length > 0)
      normal(v) /= length;
    else
      std::copy_n(jaw.normals.begin() + static_cast<std::ptrdiff_t>(3 * v), 3, normal(v).data());
  }
  return out;
}

TriangleMesh between(const TriangleMesh& toothless, const TriangleMesh& whole, float share) {
  TriangleMesh out = whole;
  for (std::size_t i = 0; i < out.positions.size(); ++i) {
    out.positions[i] = toothless.positions[i] + share * (whole.positions[i] - toothless.positions[i]);
    out.normals[i] = toothless.normals[i] + share * (whole.normals[i] - toothless.normals[i]);
  }
  return out;
}

float teethShown(double pixel) {
  const double pixels = kPitch / std::max(pixel, 1e-9);
  return static_cast<float>(std::clamp((pixels - kNone) / (kAll - kNone), 0.0, 1.0));
}

}  // namespace vest::instrument
