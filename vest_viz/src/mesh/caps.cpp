#include "caps.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>

#include "vest_tissue/net/skin.h"

namespace vest::mesh {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;

constexpr float kPinched =
    0.1f;  // of the area that a triangle's coordinates should have: stripes ten times too long
constexpr float kFlat = 0.7f;  // a cap's normals add up to so much of its area; a rounded pole's do not

}  // namespace

void spreadCaps(const Object& o, Skin* skin) {
  const std::size_t n = o.vertexCount();
  if (o.texture_coordinates.empty() || o.rest_position.empty()) return;
  std::vector<float> p(3 * n);
  net::rebuildSkin(o.rest_position.data(), o.binding_start.data(), o.binding_knots.data(),
                   o.binding_weights.data(), n, p.data());
  const auto scale = static_cast<float>(metresPerTextureUnit(o, p.data()));
  if (!(scale > 0)) return;
  const auto at = [&p](std::uint32_t v) { return Vector3f(p[3 * v], p[3 * v + 1], p[3 * v + 2]); };
  const auto uv = [&o](std::uint32_t v) {
    return Vector2f(o.texture_coordinates[2 * v], o.texture_coordinates[2 * v + 1]);
  };
  const auto across = [&](const std::uint32_t* c) {
    return (at(c[1]) - at(c[0])).cross(at(c[2]) - at(c[0]));
  };
  std::vector<std::uint32_t> parent(n);
  std::iota(parent.begin(), parent.end(), 0u);
  const auto root = [&](std::uint32_t v) {
    while (parent[v] != v) v = parent[v] = parent[parent[v]];
    return v;
  };
  std::vector<std::size_t> pinched;
  for (std::size_t t = 0; t < skin->triangles.size() / 3; ++t) {
    const std::uint32_t* c = &skin->triangles[3 * t];
    if (!o.triangle_layer.empty() && o.triangle_layer[t] == kCutFace) continue;
    const Vector2f a = uv(c[1]) - uv(c[0]), b = uv(c[2]) - uv(c[0]);
    const float area = across(c).norm();
    if (!(std::fabs(a.x() * b.y() - a.y() * b.x()) * scale * scale < kPinched * area)) continue;
    pinched.push_back(t);
    parent[root(c[0])] = root(c[1]), parent[root(c[1])] = root(c[2]);
  }
  std::map<std::uint32_t, std::vector<std::size_t>> caps;
  for (const std::size_t t : pinched) caps[root(skin->triangles[3 * t])].push_back(t);
  for (const auto& [first, triangles] : caps) {
    // Along `run` the rim's coordinates vary; across it, in the cap's plane, they are to go on.
    Vector3f normal = Vector3f::Zero();
    Vector2f mean = Vector2f::Zero();
    float area = 0;
    const float corners = 3 * static_cast<float>(triangles.size());
    for (const std::size_t t : triangles) {
      const std::uint32_t* c = &skin->triangles[3 * t];
      normal += across(c), area += across(c).norm();
      for (std::size_t k = 0; k < 3; ++k) mean += uv(c[k]) / corners;
    }
    if (normal.norm() < kFlat * area) continue;
    normal.normalize();
    Eigen::Matrix2f spread = Eigen::Matrix2f::Zero();
    for (const std::size_t t : triangles)
      for (std::size_t k = 0; k < 3; ++k) {
        const Vector2f d = uv(skin->triangles[3 * t + k]) - mean;
        spread += d * d.transpose();
      }
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2f> axes(spread);
    const Vector2f along = axes.eigenvectors().col(1), away(-along.y(), along.x());
    Vector3f run = Vector3f::Zero();
    for (const std::size_t t : triangles) {
      const std::uint32_t* c = &skin->triangles[3 * t];
      for (std::size_t k = 0; k < 3; ++k)
        run += along.dot(uv(c[k]) - mean) * normal.cross(at(c[(k + 2) % 3]) - at(c[(k + 1) % 3]));
    }
    const Vector3f step = run.norm() > 1e-9f ? normal.cross(run).normalized() : normal.unitOrthogonal();
    float low = 1e30f;
    for (const std::size_t t : triangles)
      for (std::size_t k = 0; k < 3; ++k) low = std::min(low, step.dot(at(skin->triangles[3 * t + k])));
    std::map<std::uint32_t, std::uint32_t> own;
    for (const std::size_t t : triangles)
      for (std::size_t k = 0; k < 3; ++k) {
        std::uint32_t& v = skin->triangles[3 * t + k];
        const auto [found, fresh] = own.emplace(v, static_cast<std::uint32_t>(n + skin->doubled.size()));
        if (fresh) {
          const Vector2f place = uv(v) + away * (step.dot(at(v)) - low) / scale;
          skin->doubled.push_back(v);
          skin->uv.insert(skin->uv.end(), {place.x(), place.y()});
        }
        v = found->second;
      }
  }
}

}  // namespace vest::mesh
