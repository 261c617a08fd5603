#include "vest_viz/mesh/unfold.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <utility>

#include <Eigen/Geometry>

#include "vest_tissue/net/skin.h"

namespace vest::mesh {
namespace {
constexpr int kSweeps = 150;        // by eye: further sweeps change nothing that is seen
constexpr float kFreeAngle = 1.9f;  // rad from the pole beyond which edges may stretch: the tear lies there
}  // namespace

void unfold(Object* o, const float pole[3]) {
  const std::size_t n = o->vertexCount();
  if (n == 0 || o->triangles.empty()) return;
  std::vector<float> p(3 * n);
  net::rebuildSkin(o->rest_position.data(), o->binding_start.data(), o->binding_knots.data(),
                   o->binding_weights.data(), n, p.data());
  // Vertices at one place (the old map's seam) move together.
  std::map<std::array<int, 3>, std::uint32_t> places;
  std::vector<std::uint32_t> place(n);
  std::vector<Eigen::Vector3f> x;
  for (std::size_t v = 0; v < n; ++v) {
    std::array<int, 3> key;
    for (std::size_t k = 0; k < 3; ++k) key[k] = static_cast<int>(std::lround(p[3 * v + k] * 1e5f));
    const auto found = places.emplace(key, static_cast<std::uint32_t>(x.size()));
    if (found.second) x.emplace_back(p[3 * v], p[3 * v + 1], p[3 * v + 2]);
    place[v] = found.first->second;
  }
  std::vector<std::pair<std::uint32_t, std::uint32_t>> edges;
  Eigen::Vector3f middle = Eigen::Vector3f::Zero();
  float area = 0;
  for (std::size_t t = 0; t + 2 < o->triangles.size(); t += 3) {
    std::uint32_t c[3];
    for (std::size_t k = 0; k < 3; ++k) c[k] = place[o->triangles[t + k]];
    for (std::size_t k = 0; k < 3; ++k)
      if (c[k] != c[(k + 1) % 3]) edges.push_back(std::minmax({c[k], c[(k + 1) % 3]}));
    const float a = (x[c[1]] - x[c[0]]).cross(x[c[2]] - x[c[0]]).norm();
    middle += a * (x[c[0]] + x[c[1]] + x[c[2]]) / 3.0f;
    area += a;
  }
  if (!(area > 0)) return;
  middle /= area;
  std::sort(edges.begin(), edges.end());
  edges.erase(std::unique(edges.begin(), edges.end()), edges.end());

  const Eigen::Vector3f axis(pole[0], pole[1], pole[2]);
  const Eigen::Vector3f across = axis.unitOrthogonal(), up = axis.cross(across);
  const float radius = std::sqrt(0.5f * area / (4 * 3.14159265f));  // of the sphere of the same area
  std::vector<Eigen::Vector2f> uv(x.size()), sum(x.size());
  std::vector<float> angle(x.size()), weight(x.size());
  for (std::size_t i = 0; i < x.size(); ++i) {
    const Eigen::Vector3f d = (x[i] - middle).normalized();
    const Eigen::Vector2f side(d.dot(across), d.dot(up));
    angle[i] = std::atan2(side.norm(), d.dot(axis));
    uv[i] = radius * angle[i] * side / std::max(side.norm(), 1e-6f);
  }
  const std::vector<Eigen::Vector2f> start = uv;
  std::vector<Eigen::Vector2f> shift(x.size());
  for (int sweep = 0; sweep < kSweeps; ++sweep) {
    std::fill(sum.begin(), sum.end(), Eigen::Vector2f::Zero());
    std::fill(weight.begin(), weight.end(), 0.0f);
    for (const auto& [a, b] : edges) {
      const Eigen::Vector2f d = uv[b] - uv[a];
      const float length = std::max(d.norm(), 1e-6f), wanted = (x[b] - x[a]).norm();
      const float far = std::max(angle[a], angle[b]) / kFreeAngle;
      const float w = std::exp(-far * far * far * far * far * far) + 0.002f;
      const Eigen::Vector2f step = 0.5f * w * (1.0f - wanted / length) * d;
      sum[a] += step;
      sum[b] -= step;
      weight[a] += w;
      weight[b] += w;
    }
    for (std::size_t i = 0; i < x.size(); ++i)
      if (weight[i] > 0) uv[i] += sum[i] / weight[i];
    // Springs buckle where the plane has too little room: the way from the smooth first map is kept smooth.
    for (std::size_t i = 0; i < x.size(); ++i) shift[i] = uv[i] - start[i];
    std::fill(sum.begin(), sum.end(), Eigen::Vector2f::Zero());
    std::fill(weight.begin(), weight.end(), 0.0f);
    for (const auto& [a, b] : edges) {
      sum[a] += shift[b];
      sum[b] += shift[a];
      weight[a] += 1;
      weight[b] += 1;
    }
    for (std::size_t i = 0; i < x.size(); ++i)
      if (weight[i] > 0) uv[i] = start[i] + 0.4f * shift[i] + 0.6f * sum[i] / weight[i];
  }
  o->texture_coordinates.resize(2 * n);
  for (std::size_t v = 0; v < n; ++v)
    for (std::size_t k = 0; k < 2; ++k)
      o->texture_coordinates[2 * v + k] = uv[place[v]][static_cast<Eigen::Index>(k)];
}

}  // namespace vest::mesh
