#include "vest_viz/mesh/occlusion.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>

namespace vest::mesh {
namespace {

constexpr float kCell = 0.003f;   // m
constexpr float kReach = 0.025f;  // m
constexpr int kRays = 26;
constexpr std::size_t kMostVertices = 150000;  // above, the worker would need too long
constexpr int kMaxCells =
    256;  // per axis: a scene larger than 0.77 m is not a body cavity and stays unshaded

struct Grid {
  Eigen::Vector3f origin;
  Eigen::Vector3i size;
  std::vector<std::uint8_t> full;
  bool at(const Eigen::Vector3f& p) const {
    const Eigen::Vector3i c = ((p - origin) / kCell).array().floor().cast<int>();
    if ((c.array() < 0).any() || (c.array() >= size.array()).any()) return false;
    return full[static_cast<std::size_t>((c.z() * size.y() + c.y()) * size.x() + c.x())] != 0;
  }
  void fill(const Eigen::Vector3f& p) {
    const Eigen::Vector3i c = ((p - origin) / kCell).array().floor().cast<int>();
    if ((c.array() < 0).any() || (c.array() >= size.array()).any()) return;
    full[static_cast<std::size_t>((c.z() * size.y() + c.y()) * size.x() + c.x())] = 1;
  }
};

}  // namespace

std::vector<Surface> surfacesOf(const Store& store) {
  std::vector<Surface> surfaces;
  for (std::size_t i = 0; i < store.topology().objects.size(); ++i)
    surfaces.push_back({store.skin(i).positions, store.skin(i).normals, store.skin(i).triangles});
  return surfaces;
}

std::vector<std::vector<float>> ambientOcclusion(const std::vector<Surface>& surfaces,
                                                 const std::atomic<bool>* stop) {
  std::vector<std::vector<float>> result(surfaces.size());
  std::size_t vertices = 0;
  for (const Surface& s : surfaces) vertices += s.positions.size() / 3;
  if (vertices > kMostVertices) return result;
  Eigen::AlignedBox3f box;
  for (const Surface& s : surfaces)
    for (std::size_t v = 0; v + 2 < s.positions.size(); v += 3)
      box.extend(Eigen::Map<const Eigen::Vector3f>(&s.positions[v]));
  if (box.isEmpty() || !(box.sizes().maxCoeff() < kCell * kMaxCells)) return result;
  Grid grid;
  grid.origin = box.min();
  grid.size = (box.sizes() / kCell).array().floor().cast<int>() + 1;
  grid.full.assign(static_cast<std::size_t>(grid.size.prod()), 0);
  for (const Surface& s : surfaces) {
    const std::vector<float>& p = s.positions;
    for (std::size_t t = 0; t + 2 < s.triangles.size(); t += 3) {
      const Eigen::Vector3f a = Eigen::Map<const Eigen::Vector3f>(&p[3 * s.triangles[t]]);
      const Eigen::Vector3f b = Eigen::Map<const Eigen::Vector3f>(&p[3 * s.triangles[t + 1]]);
      const Eigen::Vector3f c = Eigen::Map<const Eigen::Vector3f>(&p[3 * s.triangles[t + 2]]);
      const int steps =
          std::min(64, 1 + static_cast<int>(std::max((b - a).norm(), (c - a).norm()) / (0.7f * kCell)));
      for (int u = 0; u <= steps; ++u)
        for (int w = 0; u + w <= steps; ++w)
          grid.fill(a + (b - a) * (static_cast<float>(u) / steps) +
                    (c - a) * (static_cast<float>(w) / steps));
    }
  }
  // Directions on a cosine-weighted spiral about z.
  std::vector<Eigen::Vector3f> rays;
  for (int k = 0; k < kRays; ++k) {
    const float r2 = (k + 0.5f) / kRays, angle = 2.399963f * k;
    rays.emplace_back(std::sqrt(r2) * std::cos(angle), std::sqrt(r2) * std::sin(angle), std::sqrt(1 - r2));
  }
  for (std::size_t i = 0; i < surfaces.size(); ++i) {
    const std::size_t n = surfaces[i].positions.size() / 3;
    result[i].assign(n, 1.0f);
    for (std::size_t v = 0; v < n; ++v) {
      if (stop != nullptr && *stop) return result;
      const Eigen::Vector3f p = Eigen::Map<const Eigen::Vector3f>(&surfaces[i].positions[3 * v]);
      const Eigen::Vector3f normal = Eigen::Map<const Eigen::Vector3f>(&surfaces[i].normals[3 * v]);
      const Eigen::Quaternionf turn = Eigen::Quaternionf::FromTwoVectors(Eigen::Vector3f::UnitZ(), normal);
      float open = 0;
      for (const Eigen::Vector3f& ray : rays) {
        const Eigen::Vector3f d = turn * ray;
        float free = kReach;
        // Starts beyond the own cell and its neighbour.
        for (float s = 1.9f * kCell; s < kReach; s += 0.8f * kCell)
          if (grid.at(p + normal * (0.6f * kCell) + d * s)) {
            free = s;
            break;
          }
        open += std::min(1.0f, free / kReach);
      }
      const float share = open / kRays;
      result[i][v] = std::clamp(0.12f + 0.95f * share, 0.0f, 1.0f);
    }
  }
  return result;
}

}  // namespace vest::mesh
