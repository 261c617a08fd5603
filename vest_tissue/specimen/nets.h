#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <string>
#include <utility>

#include "vest_tissue/scene/description.h"
#include "vest_tissue/scene/step_input.h"

/// Nets and scenes made by formula.
namespace vest::specimen {

struct TubeOptions {
  std::string name = "tube";
  int rings = 16;
  int around = 8;
  double length = 0.10;          // m, along x
  double radius = 0.004;         // m
  double mass = 0.004;           // kg
  double youngs_modulus = 20e3;  // Pa
  double damping = 0.02;         // N·s/m per link
  double knot_damping = 2e-4;    // N·s/m
  double a2 = 0.0, a3 = 0.0, a4 = 0.0;
  bool fix_ends = true;
  Eigen::Vector3d centre = Eigen::Vector3d(0, 0, 0.05);
};

/// A tube along x: rings of knots; ring, longitudinal and two diagonal links: four springs a knot.
inline scene::Object tube(const TubeOptions& o) {
  using scene::Index;
  scene::Object t;
  t.name = o.name;
  t.law.youngs_modulus = o.youngs_modulus;
  t.law.a2 = o.a2, t.law.a3 = o.a3, t.law.a4 = o.a4;
  const int n = o.rings * o.around;
  const auto at = [&](int ring, int i) {
    return static_cast<Index>(ring * o.around + (i + o.around) % o.around);
  };
  for (int r = 0; r < o.rings; ++r) {
    t.tube.station.push_back(o.length * r / (o.rings - 1));
    t.tube.rings.emplace_back();
    for (int i = 0; i < o.around; ++i) {
      const double phi = 2.0 * M_PI * i / o.around;
      t.rest_position.push_back(o.centre + Eigen::Vector3d(o.length * (double(r) / (o.rings - 1) - 0.5),
                                                           o.radius * std::cos(phi),
                                                           o.radius * std::sin(phi)));
      t.mass.push_back(o.mass / n);
      t.damping.push_back(o.knot_damping);
      t.fixed.push_back(o.fix_ends && (r == 0 || r == o.rings - 1));
      t.tube.rings.back().push_back(at(r, i));
    }
  }
  t.position = t.rest_position;
  const double area =
      2.0 * M_PI * o.radius * 0.001 / o.around;  // of a wall of 1 mm, shared by the knots around
  std::set<std::pair<Index, Index>> seen;
  const auto link = [&](Index a, Index b) {
    if (!seen.insert({std::min(a, b), std::max(a, b)}).second) return;
    scene::Link l;
    l.knot0 = a, l.knot1 = b;
    l.rest = (t.rest_position[a] - t.rest_position[b]).norm();
    l.area = area, l.damping = o.damping;
    t.links.push_back(l);
  };
  for (int r = 0; r < o.rings; ++r) {
    for (int i = 0; i < o.around; ++i) {
      link(at(r, i), at(r, i + 1));
      if (r + 1 == o.rings) continue;
      link(at(r, i), at(r + 1, i));
      link(at(r, i), at(r + 1, i + 1));
      link(at(r, i), at(r + 1, i - 1));
      t.contact_triangles.push_back({at(r, i), at(r + 1, i), at(r + 1, i + 1)});
      t.contact_triangles.push_back({at(r, i), at(r + 1, i + 1), at(r, i + 1)});
    }
  }
  // Outside must be counter-clockwise: turned if the first triangle looks to the axis.
  const auto& f = t.contact_triangles.front();
  const Eigen::Vector3d p0 = t.rest_position[f[0]], p1 = t.rest_position[f[1]], p2 = t.rest_position[f[2]];
  Eigen::Vector3d out = p0 - o.centre;
  out.x() = 0;
  if ((p1 - p0).cross(p2 - p0).dot(out) < 0)
    for (auto& k : t.contact_triangles) std::swap(k[1], k[2]);
  for (int r = 0; r + 1 < o.rings;
       ++r) {  // hinges along the longitudinal edges and rings' bending keep it round
    for (int i = 0; i < o.around; ++i) {
      scene::HingeElement h;
      h.knots = {at(r, i), at(r + 1, i), at(r + 1, i - 1), at(r + 1, i + 1)};
      h.stiffness = 2e-5;
      t.hinges.push_back(h);
    }
  }
  return t;
}

/// One tube held at both ends.
inline scene::Description tubeScene(const TubeOptions& o = {}) {
  scene::Description d;
  d.name = "tube";
  d.hash = "0000000000000001";
  d.objects.push_back(tube(o));
  return d;
}

/// 21 tubes with together 2,751 knots and about 10,942 springs: the size of the seed's scene.
inline scene::Description seedSizeScene(bool connected = true) {
  scene::Description d;
  d.name = "seed_size";
  d.hash = "0000000000000002";
  int left = 2751;
  for (int i = 0; i < 21; ++i) {
    TubeOptions o;
    o.name = "tube_" + std::to_string(i);
    o.around = i == 20 ? 3 : 8;
    const int wanted = i == 20 ? left : 131 / 8 * 8 + (i % 3 == 0 ? 8 : 0);
    o.rings = wanted / o.around;
    left -= o.rings * o.around;
    o.centre = Eigen::Vector3d(0.0, 0.012 * (i % 7), 0.03 + 0.02 * (i / 7));
    o.a2 = 1.0, o.a3 = 5.0, o.a4 = 20.0;
    d.objects.push_back(tube(o));
  }
  if (connected) {
    for (int i = 0; i + 1 < 20; ++i) {
      scene::Connection c;
      c.object0 = "tube_" + std::to_string(i), c.object1 = "tube_" + std::to_string(i + 1);
      c.knot0 = 64;
      c.triangle1 = {64, 65, 72};
      c.weights1 = {0.5, 0.25, 0.25};
      Eigen::Vector3d anchor = Eigen::Vector3d::Zero();
      for (int k = 0; k < 3; ++k) anchor += c.weights1[k] * d.objects[i + 1].position[c.triangle1[k]];
      c.offset = d.objects[i].position[64] - anchor;
      c.stiffness = 20.0, c.damping = 0.01;
      d.connections.push_back(c);
    }
  }
  return d;
}

/// A grasper that comes from above, its tip at `tip`, closing across the tube's axis (jaws open along y).
inline scene::ToolInput grasper(const Eigen::Vector3d& tip, double jaw) {
  scene::ToolInput t;
  t.present = true;
  t.tool = tools::ToolKind::Grasper;
  t.position = tip;
  t.pivot = tip + Eigen::Vector3d(0, 0, 0.12);
  t.jaw = jaw;
  Eigen::Matrix3d r;
  r.col(2) = -Eigen::Vector3d::UnitZ();
  r.col(0) = Eigen::Vector3d::UnitY();
  r.col(1) = r.col(2).cross(r.col(0));
  t.orientation = Eigen::Quaterniond(r);
  return t;
}

/// A grasper in the direction `z`, its jaws opening along `x` (unit vectors).
inline scene::ToolInput grasper(const Eigen::Vector3d& tip, const Eigen::Vector3d& z,
                                const Eigen::Vector3d& x, double jaw) {
  scene::ToolInput t = grasper(tip, jaw);
  t.pivot = tip - 0.12 * z;
  Eigen::Matrix3d r;
  r << x, z.cross(x), z;
  t.orientation = Eigen::Quaterniond(r);
  return t;
}

}  // namespace vest::specimen
