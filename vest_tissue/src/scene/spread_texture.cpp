#include "vest_tissue/scene/spread_texture.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <Eigen/Geometry>

namespace vest::scene {
namespace {
constexpr int kSweeps = 150;        // by eye: further sweeps change nothing that is seen
constexpr double kFreeAngle = 1.9;  // rad from `facing` beyond which edges may stretch: the tear lies there
}  // namespace

void spreadTexture(const std::vector<Eigen::Vector3d>& knots, const Eigen::Vector3d& facing, Skin* skin) {
  const std::size_t n = skin->texture_coordinates.size();
  std::vector<Eigen::Vector3d> x(n, Eigen::Vector3d::Zero());
  for (std::size_t v = 0; v < n; ++v)
    for (std::size_t e = skin->binding_start[v]; e < skin->binding_start[v + 1]; ++e)
      x[v] += static_cast<double>(skin->binding_weights[e]) * knots[skin->binding_knots[e]];
  std::vector<std::pair<std::uint32_t, std::uint32_t>> edges;
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  double area = 0;
  for (const auto& t : skin->triangles) {
    for (std::size_t k = 0; k < 3; ++k) edges.push_back(std::minmax({t[k], t[(k + 1) % 3]}));
    const double a = (x[t[1]] - x[t[0]]).cross(x[t[2]] - x[t[0]]).norm();
    middle += a / 3 * (x[t[0]] + x[t[1]] + x[t[2]]);
    area += a;
  }
  if (!(area > 0)) return;
  middle /= area;
  std::sort(edges.begin(), edges.end());
  edges.erase(std::unique(edges.begin(), edges.end()), edges.end());

  const Eigen::Vector3d axis = facing.normalized(), across = axis.unitOrthogonal(), up = axis.cross(across);
  const double radius = std::sqrt(0.5 * area / (4 * EIGEN_PI));  // of the sphere of the same area
  std::vector<Eigen::Vector2d> uv(n), sum(n);
  std::vector<double> angle(n), weight(n);
  for (std::size_t i = 0; i < n; ++i) {
    const Eigen::Vector3d d = (x[i] - middle).normalized();
    const Eigen::Vector2d side(d.dot(across), d.dot(up));
    angle[i] = std::atan2(side.norm(), d.dot(axis));
    uv[i] = radius * angle[i] / std::max(side.norm(), 1e-9) * side;
  }
  const std::vector<Eigen::Vector2d> start = uv;
  std::vector<Eigen::Vector2d> shift(n);
  for (int sweep = 0; sweep < kSweeps; ++sweep) {
    std::fill(sum.begin(), sum.end(), Eigen::Vector2d::Zero());
    std::fill(weight.begin(), weight.end(), 0.0);
    for (const auto& [a, b] : edges) {
      const Eigen::Vector2d d = uv[b] - uv[a];
      const double length = std::max(d.norm(), 1e-9), wanted = (x[b] - x[a]).norm();
      const double far = std::max(angle[a], angle[b]) / kFreeAngle;
      const double w = std::exp(-far * far * far * far * far * far) + 0.002;
      const Eigen::Vector2d step = 0.5 * w * (1.0 - wanted / length) * d;
      sum[a] += step;
      sum[b] -= step;
      weight[a] += w;
      weight[b] += w;
    }
    for (std::size_t i = 0; i < n; ++i)
      if (weight[i] > 0) uv[i] += sum[i] / weight[i];
    // Springs buckle where the plane has too little room: the way from the smooth first map is kept smooth.
    for (std::size_t i = 0; i < n; ++i) shift[i] = uv[i] - start[i];
    std::fill(sum.begin(), sum.end(), Eigen::Vector2d::Zero());
    std::fill(weight.begin(), weight.end(), 0.0);
    for (const auto& [a, b] : edges) {
      sum[a] += shift[b];
      sum[b] += shift[a];
      weight[a] += 1;
      weight[b] += 1;
    }
    for (std::size_t i = 0; i < n; ++i)
      if (weight[i] > 0) uv[i] = start[i] + 0.4 * shift[i] + 0.6 / weight[i] * sum[i];
  }
  for (std::size_t i = 0; i < n; ++i) {
    // To a tenth of a micrometre: the last bits of a square root differ from library to library.
    for (Eigen::Index k = 0; k < 2; ++k)
      skin->texture_coordinates[i][static_cast<std::size_t>(k)] =
          static_cast<float>(1e-7 * std::round(1e7 * uv[i][k]));
  }
}

}  // namespace vest::scene
