#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

#include <Eigen/Geometry>

#include "nets.h"
#include "vest_tissue/net/skin.h"
#include "vest_tissue/scene/topology.h"
#include "vest_tissue/scene/world.h"

/// Blades and sheets that are cut.
namespace vest::specimen {

/// A tool with its tip at `tip`, its shaft along `along`, its jaws opening along `opening`.
inline scene::ToolInput toolAt(tools::ToolKind kind, const Eigen::Vector3d& tip, const Eigen::Vector3d& along,
                               const Eigen::Vector3d& opening, double jaw = 0.0) {
  scene::ToolInput t;
  t.present = true;
  t.tool = kind;
  t.position = tip;
  t.pivot = tip - 0.12 * along.normalized();
  t.jaw = jaw;
  Eigen::Matrix3d r;
  r.col(2) = along.normalized();
  r.col(0) = (opening - opening.dot(r.col(2)) * r.col(2)).normalized();
  r.col(1) = r.col(2).cross(r.col(0));
  t.orientation = Eigen::Quaterniond(r);
  return t;
}

/// A closed solid bar along x, columns × 2 × 2 knots thick: surface triangles, links along edges and
/// diagonals, struts through it, hinges, a skin that is the surface itself, a volume.
struct BarOptions {
  int columns = 17, rows = 5;    // along x, along y
  double spacing = 0.004;        // m
  double thickness = 0.004;      // m, along z
  double mass = 0.01;            // kg
  double youngs_modulus = 20e3;  // Pa
  double bulk_modulus = 20e3;    // Pa
  bool fix_left = true, fix_right = true;
  Eigen::Vector3d centre = Eigen::Vector3d(0, 0, 0.05);
};

inline scene::Object bar(const BarOptions& o) {
  using scene::Index;
  scene::Object b;
  b.name = "bar";
  b.law.youngs_modulus = o.youngs_modulus;
  const int layer = o.columns * o.rows, knots = 2 * layer;
  const auto at = [&](int x, int y, int z) { return static_cast<Index>(z * layer + y * o.columns + x); };
  for (int z = 0; z < 2; ++z) {
    for (int y = 0; y < o.rows; ++y) {
      for (int x = 0; x < o.columns; ++x) {
        b.rest_position.push_back(o.centre + Eigen::Vector3d(o.spacing * (x - 0.5 * (o.columns - 1)),
                                                             o.spacing * (y - 0.5 * (o.rows - 1)),
                                                             o.thickness * (z - 0.5)));
        b.mass.push_back(o.mass / knots);
        b.damping.push_back(5.0 * o.mass / knots);
        b.fixed.push_back((x == 0 && o.fix_left) || (x + 1 == o.columns && o.fix_right));
      }
    }
  }
  b.position = b.rest_position;
  const auto quad = [&](Index p, Index q, Index r, Index s) {  // counter-clockwise from outside
    b.contact_triangles.push_back({p, q, r});
    b.contact_triangles.push_back({p, r, s});
  };
  for (int y = 0; y + 1 < o.rows; ++y) {
    for (int x = 0; x + 1 < o.columns; ++x) {
      quad(at(x, y, 1), at(x + 1, y, 1), at(x + 1, y + 1, 1), at(x, y + 1, 1));
      quad(at(x, y, 0), at(x, y + 1, 0), at(x + 1, y + 1, 0), at(x + 1, y, 0));
    }
    quad(at(0, y, 0), at(0, y, 1), at(0, y + 1, 1), at(0, y + 1, 0));
    const int e = o.columns - 1;
    quad(at(e, y, 0), at(e, y + 1, 0), at(e, y + 1, 1), at(e, y, 1));
  }
  for (int x = 0; x + 1 < o.columns; ++x) {
    quad(at(x, 0, 0), at(x + 1, 0, 0), at(x + 1, 0, 1), at(x, 0, 1));
    const int e = o.rows - 1;
    quad(at(x, e, 0), at(x, e, 1), at(x + 1, e, 1), at(x + 1, e, 0));
  }
  std::set<std::pair<Index, Index>> seen;
  const auto link = [&](Index p, Index q) {
    if (!seen.insert({std::min(p, q), std::max(p, q)}).second) return;
    scene::Link l;
    l.knot0 = p, l.knot1 = q;
    l.rest = (b.rest_position[p] - b.rest_position[q]).norm();
    l.area = 0.25 * o.spacing * o.thickness, l.damping = 0.02;
    b.links.push_back(l);
  };
  for (const auto& t : b.contact_triangles)
    for (int e = 0; e < 3; ++e) link(t[e], t[(e + 1) % 3]);
  for (int y = 0; y < o.rows; ++y) {
    for (int x = 0; x < o.columns; ++x) {
      link(at(x, y, 0), at(x, y, 1));
      if (x + 1 < o.columns) link(at(x, y, 0), at(x + 1, y, 1)), link(at(x + 1, y, 0), at(x, y, 1));
      if (y + 1 < o.rows) link(at(x, y, 0), at(x, y + 1, 1)), link(at(x, y + 1, 0), at(x, y, 1));
      for (int z = 0; z < 2; ++z)
        if (x + 2 < o.columns) link(at(x, y, z), at(x + 2, y, z));
    }
  }
  if (o.bulk_modulus > 0.0) b.volumes.push_back({b.contact_triangles, o.bulk_modulus, 0.0});
  b.skin.binding_start.push_back(0);
  for (Index k = 0; k < static_cast<Index>(knots); ++k) {
    b.skin.binding_knots.push_back(k);
    b.skin.binding_weights.push_back(1.0f);
    b.skin.binding_start.push_back(k + 1);
    b.skin.texture_coordinates.push_back({0, 0});
  }
  for (const auto& t : b.contact_triangles) {
    b.skin.triangles.push_back({t[0], t[1], t[2]});
    b.skin.layer.push_back(0);
  }
  return b;
}

inline scene::Description barScene(const BarOptions& o = {}) {
  scene::Description d;
  d.name = "bar";
  d.hash = "0000000000000003";
  d.objects.push_back(bar(o));
  return d;
}

/// Connected pieces of an object's living links and skin-bearing knots, by link alone.
inline std::size_t pieces(const scene::World& w, std::size_t object, std::vector<std::uint32_t>& part) {
  part.resize(w.knotCount(object));
  for (std::uint32_t i = 0; i < part.size(); ++i) part[i] = i;
  const auto root = [&](std::uint32_t i) {
    while (part[i] != i) i = part[i];
    return i;
  };
  const scene::Topology& t = w.topology(object);
  for (std::size_t i = 0; i < t.links.size(); ++i) {
    if (!t.link_alive[i]) continue;
    const std::uint32_t a = root(t.links[i].knot0), b = root(t.links[i].knot1);
    part[std::max(a, b)] = std::min(a, b);
  }
  std::size_t count = 0;
  for (std::uint32_t i = 0; i < part.size(); ++i) {
    part[i] = root(i);
    count += part[i] == i;
  }
  return count;
}

/// Skin vertices now, m.
inline std::vector<float> skinNow(const scene::World& w, std::size_t object) {
  const scene::Skin& s = w.topology(object).skin;
  std::vector<float> knots(3 * w.knotCount(object)), out(3 * (s.binding_start.size() - 1));
  w.positions(object, knots.data());
  net::rebuildSkin(knots.data(), s.binding_start.data(), s.binding_knots.data(), s.binding_weights.data(),
                   s.binding_start.size() - 1, out.data());
  return out;
}

/// m/s.
inline double fastestKnot(const scene::World& w) {
  double most = 0.0;
  std::vector<float> v;
  for (std::size_t o = 0; o < w.objectCount(); ++o) {
    v.resize(3 * w.knotCount(o));
    w.velocities(o, v.data());
    for (std::size_t k = 0; k < v.size(); k += 3)
      most = std::max(most, static_cast<double>(Eigen::Vector3f(v[k], v[k + 1], v[k + 2]).norm()));
  }
  return most;
}

}  // namespace vest::specimen
