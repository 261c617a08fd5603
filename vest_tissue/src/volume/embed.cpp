#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <unordered_map>

#include <Eigen/LU>

#include "place_text.h"
#include "vest_tissue/base/nearest.h"
#include "vest_tissue/scene/fem_object.h"
#include "vest_tissue/volume/lattice.h"

namespace vest::volume {
namespace {

using Eigen::Vector3d;

constexpr std::size_t kMostEntries = 8000000;  // of a grid, and boxes looked at for them / 8 (assumed)
constexpr std::size_t kMostLooks = 200000000;  // at tetrahedra: seconds (assumed)

struct Box {
  Vector3d low = Vector3d::Constant(1e300), high = Vector3d::Constant(-1e300);
  void add(const Vector3d& v) { low = low.cwiseMin(v), high = high.cwiseMax(v); }
  Vector3d size() const { return high - low; }
};

/// What is embedded, or moves the boundary, lies about where the mesh is, and is of its size.
void checkSizes(const Lattice& lattice, const Surface& surface) {
  Box mesh, whole;
  for (const Vector3d& x : lattice.nodes) mesh.add(x);
  for (const Vector3d& v : surface.vertices) whole.add(v);
  const double reach = mesh.size().norm();
  for (const Vector3d& v : surface.vertices) {
    const Vector3d off = (mesh.low - v).cwiseMax(v - mesh.high).cwiseMax(0.0);
    if (off.norm() <= reach) continue;
    throw std::invalid_argument("a vertex at " + text(v) + " of a surface of the size " + text(whole.size()) +
                                " is far from the mesh, which has the size " + text(mesh.size()) + " from " +
                                text(mesh.low) + " on; allowed: no further from it than its diagonal, " +
                                std::to_string(reach));
  }
}

/// Boxes of a regular grid with the items that touch them.
class ItemGrid {
 public:
  explicit ItemGrid(double spacing) : inverse_(1.0 / spacing) {}
  /// Into the boxes from low to high where touches(low corner, high corner) holds.
  template <class Touches>
  void add(const Vector3d& low, const Vector3d& high, Index item, Touches touches) {
    each(low, high, [&](std::uint64_t key, const Vector3d& corner) {
      if (++looks_ > 8 * kMostEntries) refuse();
      if (!touches(corner / inverse_, (corner + Vector3d::Ones()) / inverse_)) return;
      boxes_[key].push_back(item);
      if (++entries_ > kMostEntries) refuse();
    });
  }
  template <class Visit>
  void near(const Vector3d& low, const Vector3d& high, Visit visit) const {
    each(low, high, [&](std::uint64_t key, const Vector3d&) {
      const auto found = boxes_.find(key);
      if (found == boxes_.end()) return;
      for (const Index i : found->second) visit(i);
    });
  }

 private:
  [[noreturn]] static void refuse() {
    throw std::invalid_argument(
        "too many of its parts are much larger than a cell; allowed: finer ones, or larger cells");
  }
  template <class Visit>
  void each(const Vector3d& low, const Vector3d& high, Visit visit) const {
    std::array<std::int64_t, 3> a{}, b{};
    for (int c = 0; c < 3; ++c) {
      a[static_cast<std::size_t>(c)] = static_cast<std::int64_t>(std::floor(low[c] * inverse_));
      b[static_cast<std::size_t>(c)] = static_cast<std::int64_t>(std::floor(high[c] * inverse_));
    }
    for (std::int64_t i = a[0]; i <= b[0]; ++i)
      for (std::int64_t j = a[1]; j <= b[1]; ++j)
        for (std::int64_t k = a[2]; k <= b[2]; ++k)
          visit((static_cast<std::uint64_t>(i + 1048576) << 42) ^
                    (static_cast<std::uint64_t>(j + 1048576) << 21) ^ static_cast<std::uint64_t>(k + 1048576),
                Vector3d(static_cast<double>(i), static_cast<double>(j), static_cast<double>(k)));
  }
  double inverse_;
  std::size_t entries_ = 0, looks_ = 0;
  std::unordered_map<std::uint64_t, std::vector<Index>> boxes_;
};

double volumeOf(const std::vector<Vector3d>& x, const std::array<Index, 4>& t) {
  return (x[t[1]] - x[t[0]]).dot((x[t[2]] - x[t[0]]).cross(x[t[3]] - x[t[0]])) / 6.0;
}

}  // namespace

void fitBoundary(Lattice& lattice, const Surface& surface, double cell) {
  checkSizes(lattice, surface);
  const double reach = 0.7 * cell;
  Box mesh;
  for (const Vector3d& x : lattice.nodes) mesh.add(x);
  mesh.low.array() -= 2.0 * cell, mesh.high.array() += 2.0 * cell;  // beyond, no node looks
  ItemGrid grid(cell);
  const auto corners = [&](Index t) {
    const auto& k = surface.triangles[t];
    return std::array<Vector3d, 3>{surface.vertices[k[0]], surface.vertices[k[1]], surface.vertices[k[2]]};
  };
  for (Index t = 0; t < surface.triangles.size(); ++t) {
    const auto p = corners(t);
    const Vector3d normal = (p[1] - p[0]).cross(p[2] - p[0]);
    const double at = normal.dot(p[0]);
    grid.add(p[0].cwiseMin(p[1]).cwiseMin(p[2]).cwiseMax(mesh.low),
             p[0].cwiseMax(p[1]).cwiseMax(p[2]).cwiseMin(mesh.high), t,
             [&](const Vector3d& low, const Vector3d& high) {  // its plane crosses the box, or nearly
               const double off = normal.dot(0.5 * (low + high)) - at;
               return std::fabs(off) <= 0.51 * normal.cwiseAbs().dot(high - low);
             });
  }
  std::vector<std::vector<Index>> around(lattice.nodes.size());
  std::vector<double> least;
  for (Index e = 0; e < lattice.tetrahedra.size(); ++e) {
    for (const Index n : lattice.tetrahedra[e]) around[n].push_back(e);
    least.push_back(0.25 * volumeOf(lattice.nodes, lattice.tetrahedra[e]));
  }
  std::vector<std::uint8_t> boundary(lattice.nodes.size(), 0);
  for (const auto& f : scene::boundaryFaces(lattice.tetrahedra))
    for (const Index n : f) boundary[n] = 1;
  for (Index n = 0; n < lattice.nodes.size(); ++n) {
    if (boundary[n] == 0) continue;
    const Vector3d from = lattice.nodes[n];
    double best = reach;
    Vector3d to = from;
    grid.near(from.array() - reach, from.array() + reach, [&](Index t) {
      const auto p = corners(t);
      const contact::Nearest near = contact::nearest(from, p);
      if (!(near.distance < best)) return;
      best = near.distance;
      to = near.weights[0] * p[0] + near.weights[1] * p[1] + near.weights[2] * p[2];
    });
    for (double part = 1.0; part > 0.1; part *= 0.5) {
      lattice.nodes[n] = from + part * (to - from);
      const bool good = std::all_of(around[n].begin(), around[n].end(), [&](Index e) {
        return volumeOf(lattice.nodes, lattice.tetrahedra[e]) > least[e];
      });
      if (good) break;
      lattice.nodes[n] = from;
    }
  }
}

scene::Skin embed(const Lattice& lattice, const Surface& surface) {
  checkSizes(lattice, surface);
  double edge = 0.0;
  for (const auto& t : lattice.tetrahedra)
    for (std::size_t a = 0; a < 4; ++a)
      for (std::size_t b = a + 1; b < 4; ++b)
        edge = std::max(edge, (lattice.nodes[t[b]] - lattice.nodes[t[a]]).norm());
  std::size_t looks = 0;
  ItemGrid grid(std::max(edge, 1e-9));
  const auto& x = lattice.nodes;
  for (Index e = 0; e < lattice.tetrahedra.size(); ++e) {
    const auto& t = lattice.tetrahedra[e];
    grid.add(x[t[0]].cwiseMin(x[t[1]]).cwiseMin(x[t[2]]).cwiseMin(x[t[3]]),
             x[t[0]].cwiseMax(x[t[1]]).cwiseMax(x[t[2]]).cwiseMax(x[t[3]]), e,
             [](const Vector3d&, const Vector3d&) { return true; });
  }
  scene::Skin skin;
  skin.binding_start.push_back(0);
  for (const Vector3d& v : surface.vertices) {
    Eigen::Vector4d best = Eigen::Vector4d::Zero();
    std::array<Index, 4> nodes{};
    double outside = 1e300;  // m: how far the point lies beyond the tetrahedron's faces, at most
    const auto look = [&](Index e) {
      if (++looks > kMostLooks)
        throw std::invalid_argument(
            "too many tetrahedra for too many vertices of the skin; allowed: a coarser "
            "skin, or tetrahedra of about one size");
      const auto& t = lattice.tetrahedra[e];
      const Vector3d e1 = x[t[1]] - x[t[0]], e2 = x[t[2]] - x[t[0]], e3 = x[t[3]] - x[t[0]], d = v - x[t[0]];
      const double six = e1.dot(e2.cross(e3));
      Eigen::Vector4d w;
      w[1] = d.dot(e2.cross(e3)) / six;
      w[2] = e1.dot(d.cross(e3)) / six;
      w[3] = e1.dot(e2.cross(d)) / six;
      w[0] = 1.0 - w[1] - w[2] - w[3];
      const double out = std::max(0.0, -w.minCoeff()) * edge;
      if (out >= outside) return;
      outside = out, best = w, nodes = t;
    };
    for (double reach = 0.01 * edge; outside > 1e299 && reach < 64.0 * edge; reach *= 4.0)
      grid.near(v.array() - reach, v.array() + reach, look);
    if (outside > 1e299)
      for (Index e = 0; e < lattice.tetrahedra.size(); ++e) look(e);
    for (std::size_t k = 0; k < 4; ++k) {
      skin.binding_knots.push_back(nodes[k]);
      skin.binding_weights.push_back(static_cast<float>(best[static_cast<Eigen::Index>(k)]));
    }
    skin.binding_start.push_back(static_cast<std::uint32_t>(skin.binding_knots.size()));
    skin.texture_coordinates.push_back(
        {static_cast<float>(v.x() + 0.5 * v.z()), static_cast<float>(v.y() + 0.5 * v.z())});
  }
  for (const auto& t : surface.triangles) skin.triangles.push_back({t[0], t[1], t[2]});
  skin.layer.assign(skin.triangles.size(), 0);
  return skin;
}

}  // namespace vest::volume
