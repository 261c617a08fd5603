#include "vest_viz/mesh/occlusion.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>
#include <utility>

#include <Eigen/Geometry>

namespace vest::mesh {
namespace {

constexpr float kCell = 0.003f;   // m
constexpr float kReach = 0.025f;  // m
constexpr int kRays = 26;
constexpr float kContact = 0.8f;  // what touches moves away, and its shadow stays: never quite dark (by eye)
constexpr std::size_t kMostVertices = 150000;  // above, the worker would need too long
constexpr std::size_t kMostMiddles = 30000;    // of one surface, as above
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

/// A piece of a surface, for what lies so near that the grid is too coarse for it.
struct Patch {
  Eigen::Vector3f place, normal;
  float area;  // m2
  std::size_t surface;
};

/// Patches of at most kPatch by kPatch, by cell of kNear.
class Patches {
 public:
  static constexpr float kPatch = 0.0025f;  // m
  static constexpr float kNear = 0.007f;    // m: how far they reach; farther out the rays see more

  explicit Patches(const std::vector<Surface>& surfaces) {
    for (std::size_t i = 0; i < surfaces.size(); ++i) {
      const Surface& s = surfaces[i];
      const auto corner = [&](std::size_t k) {
        return Eigen::Map<const Eigen::Vector3f>(&s.positions[3 * static_cast<std::size_t>(s.triangles[k])]);
      };
      for (std::size_t t = 0; t + 2 < s.triangles.size(); t += 3)
        add(i, corner(t), corner(t + 1), corner(t + 2));
    }
  }

  /// Whether another surface lies within the distance.
  bool near(std::size_t surface, const Eigen::Vector3f& p, float distance) const {
    const std::array<int, 3> c = cellOf(p);
    const int reach = static_cast<int>(distance / kNear) + 1;
    for (int x = -reach; x <= reach; ++x)
      for (int y = -reach; y <= reach; ++y)
        for (int z = -reach; z <= reach; ++z) {
          const auto cell = cells_.find({c[0] + x, c[1] + y, c[2] + z});
          if (cell == cells_.end()) continue;
          for (const Patch& patch : cell->second)
            if (patch.surface != surface && (patch.place - p).norm() < distance) return true;
        }
    return false;
  }

  /// Share of the sky over a vertex that other surfaces within kNear hide: sum of the form factors of discs,
  /// Bunnell 2005 (GPU Gems 2, chapter 14).
  float hidden(std::size_t surface, const Eigen::Vector3f& p, const Eigen::Vector3f& normal) const {
    constexpr float kPi = 3.14159265f;
    float sum = 0;
    const std::array<int, 3> c = cellOf(p);
    for (int x = -1; x <= 1; ++x)
      for (int y = -1; y <= 1; ++y)
        for (int z = -1; z <= 1; ++z) {
          const auto cell = cells_.find({c[0] + x, c[1] + y, c[2] + z});
          if (cell == cells_.end()) continue;
          for (const Patch& patch : cell->second) {
            if (patch.surface == surface) continue;
            const Eigen::Vector3f d = patch.place - p;
            const float r2 = d.squaredNorm();
            if (r2 > kNear * kNear || r2 < 1e-12f) continue;
            const float up = normal.dot(d), facing = std::fabs(patch.normal.dot(d));
            if (up <= 0) continue;
            sum += patch.area * up * facing / (r2 * (kPi * r2 + patch.area));
          }
        }
    return std::min(sum, 1.0f);
  }

 private:
  void add(std::size_t surface, const Eigen::Vector3f& a, const Eigen::Vector3f& b,
           const Eigen::Vector3f& c) {
    const Eigen::Vector3f across = (b - a).cross(c - a);
    const float area = 0.5f * across.norm();
    if (!(area > 0)) return;
    const float longest = std::max({(b - a).norm(), (c - b).norm(), (a - c).norm()});
    const int n = std::clamp(static_cast<int>(longest / kPatch) + 1, 1, 32);
    // n² like triangles; their centres.
    const auto put = [&](float u, float w) {
      const Eigen::Vector3f p = a + (b - a) * u + (c - a) * w;
      cells_[cellOf(p)].push_back({p, across.normalized(), area / static_cast<float>(n * n), surface});
    };
    const float s = 1.0f / static_cast<float>(n), third = s / 3;
    for (int i = 0; i < n; ++i)
      for (int j = 0; i + j < n; ++j) {
        put(static_cast<float>(i) * s + third, static_cast<float>(j) * s + third);
        if (i + j + 1 < n) put(static_cast<float>(i) * s + 2 * third, static_cast<float>(j) * s + 2 * third);
      }
  }

  static std::array<int, 3> cellOf(const Eigen::Vector3f& p) {
    const Eigen::Vector3i c = (p / kNear).array().floor().cast<int>();
    return {c.x(), c.y(), c.z()};
  }

  std::map<std::array<int, 3>, std::vector<Patch>> cells_;
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
  const Patches patches(surfaces);
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
      const float share = open / kRays * (1.0f - kContact * patches.hidden(i, p, normal));
      result[i][v] = std::clamp(0.12f + 0.95f * share, 0.0f, 1.0f);
    }
  }
  return result;
}

Refined refineForContact(const std::vector<Surface>& surfaces, std::size_t index) {
  using Edge = std::pair<std::uint32_t, std::uint32_t>;
  constexpr std::uint32_t kNone = 0xffffffffu;
  const Patches patches(surfaces);
  Refined result{surfaces[index].triangles, {}};
  std::vector<float> positions = surfaces[index].positions;
  const auto at = [&](std::uint32_t v) {
    return Eigen::Map<const Eigen::Vector3f>(&positions[3 * static_cast<std::size_t>(v)]);
  };
  const auto edge = [](std::uint32_t a, std::uint32_t b) { return a < b ? Edge{a, b} : Edge{b, a}; };
  const auto length = [&](const Edge& e) { return (at(e.first) - at(e.second)).norm(); };
  std::set<Edge> stay;  // looked at before
  for (bool again = true; again && result.middles.size() < kMostMiddles;) {
    std::map<Edge, std::uint32_t> halved;  // with the new vertex
    std::vector<std::uint32_t>& triangles = result.triangles;
    const auto longest = [&](std::size_t t) {
      Edge found = edge(triangles[t], triangles[t + 1]);
      for (const Edge& e : {edge(triangles[t + 1], triangles[t + 2]), edge(triangles[t + 2], triangles[t])})
        if (length(e) > length(found)) found = e;
      return found;
    };
    for (std::size_t t = 0; t + 2 < triangles.size(); t += 3) {
      const Edge e = longest(t);
      const float l = length(e);
      if (l <= Patches::kPatch || stay.count(e) != 0 || halved.count(e) != 0) continue;
      if (patches.near(index, 0.5f * (at(e.first) + at(e.second)), Patches::kNear + 0.5f * l))
        halved.emplace(e, kNone);
      else
        stay.insert(e);
    }
    // A triangle of which any edge is halved has its longest halved, too: none gets thin (Rivara 1984).
    for (bool grown = !halved.empty(); grown;) {
      grown = false;
      for (std::size_t t = 0; t + 2 < triangles.size(); t += 3) {
        bool any = false;
        for (std::size_t k = 0; k < 3; ++k)
          any = any || halved.count(edge(triangles[t + k], triangles[t + (k + 1) % 3])) != 0;
        grown = (any && halved.emplace(longest(t), kNone).second) || grown;
      }
    }
    again = !halved.empty();
    for (auto& [e, middle] : halved) {
      middle = static_cast<std::uint32_t>(positions.size() / 3);
      result.middles.push_back({e.first, e.second});
      const Eigen::Vector3f m = 0.5f * (at(e.first) + at(e.second));
      positions.insert(positions.end(), {m.x(), m.y(), m.z()});
    }
    std::vector<std::uint32_t> finer;
    for (std::size_t t = 0; t + 2 < triangles.size(); t += 3) {
      // Turned so that the longest edge comes first: where any is halved, that one is.
      const Edge first = longest(t);
      std::size_t k = 0;
      while (k < 2 && edge(triangles[t + k], triangles[t + (k + 1) % 3]) != first) ++k;
      const std::uint32_t a = triangles[t + k], b = triangles[t + (k + 1) % 3],
                          c = triangles[t + (k + 2) % 3];
      const auto middle = [&](std::uint32_t u, std::uint32_t v) {
        const auto found = halved.find(edge(u, v));
        return found == halved.end() ? kNone : found->second;
      };
      const std::uint32_t ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
      const auto put = [&](std::uint32_t u, std::uint32_t v, std::uint32_t w, std::uint32_t vw) {
        if (vw == kNone)
          finer.insert(finer.end(), {u, v, w});
        else
          finer.insert(finer.end(), {u, v, vw, u, vw, w});
      };
      if (ab == kNone) {
        finer.insert(finer.end(), {a, b, c});
      } else {
        put(ab, b, c, bc);
        put(ab, c, a, ca);
      }
    }
    triangles = std::move(finer);
  }
  return result;
}

}  // namespace vest::mesh
