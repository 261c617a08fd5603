#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <numeric>
#include <set>
#include <tuple>

#include <Eigen/Geometry>

#include "vest_tissue/base/grid_cost.h"
#include "vest_tissue/files/yaml_reader.h"
#include "vest_tissue/scene/baked.h"
#include "vest_tissue/scene/edits.h"

namespace vest::scene {
namespace {

// Of all rigid objects: 130 MB, and two seconds (assumed).
constexpr double kMostWallPoints = 33554432, kMostWallLooks = 5e8;
constexpr double kLeastMass = 1e-30;  // single precision holds its inverse
/// Of the distance from the origin: four spacings of single precision.
constexpr double kResolved = 4.8e-7;

class Check {
 public:
  Check(const Object& object, const std::string& file) : object_(object), file_(file) {}

  [[noreturn]] void fail(const std::string& field, std::size_t index, const std::string& value,
                         const std::string& allowed) const {
    yaml::fail(file_, 0, object_.name + "." + field + "[" + std::to_string(index) + "]", value, allowed);
  }
  void size(const std::string& field, std::size_t size, std::size_t expected) const {
    if (size != expected) {
      yaml::fail(file_, 0, object_.name + "." + field, std::to_string(size) + " entries",
                 "must have " + std::to_string(expected) + " entries");
    }
  }
  void knot(const std::string& field, std::size_t index, Index knot) const {
    if (knot >= object_.rest_position.size()) {
      fail(field, index, "knot " + std::to_string(knot),
           "must be a knot from 0 to " + std::to_string(object_.rest_position.size() - 1));
    }
  }
  void number(const std::string& field, std::size_t index, double value, double least,
              const char* allowed) const {
    if (!(value >= least && value <= kGreatest))
      fail(field, index, text(value), std::string(allowed) + ", at most 1e30");
  }
  void place(const std::string& field, std::size_t index, const Eigen::Vector3d& x) const {
    for (const double c : {x.x(), x.y(), x.z()}) {
      if (!(std::abs(c) <= kFarthest))
        fail(field, index, text(c), "must be a coordinate from -500000 to 500000");
    }
  }
  static std::string text(double value) {
    char buffer[32];
    std::snprintf(buffer, sizeof buffer, "%g", value);
    return buffer;
  }

 private:
  const Object& object_;
  const std::string& file_;
};

std::string sizeText(const Eigen::Vector3d& size) {
  return "(" + Check::text(size.x()) + ", " + Check::text(size.y()) + ", " + Check::text(size.z()) + ") m";
}

std::tuple<int, Index, Index, Index> linkKey(const Link& link) {
  if (link.kind == LinkKind::Bending) {
    return {3, link.knot1, std::min(link.knot0, link.knot2), std::max(link.knot0, link.knot2)};
  }
  return {static_cast<int>(link.kind), std::min(link.knot0, link.knot1), std::max(link.knot0, link.knot1), 0};
}

void checkSkin(const Object& object, const Check& check) {
  const Skin& skin = object.skin;
  if (skin.binding_start.empty() && skin.triangles.empty()) return;
  const std::size_t vertices = skin.texture_coordinates.size();
  check.size("skin.binding_start", skin.binding_start.size(), vertices + 1);
  check.size("skin.binding_weights", skin.binding_weights.size(), skin.binding_knots.size());
  check.size("skin.layer", skin.layer.size(), skin.triangles.size());
  if (skin.binding_start.front() != 0)
    check.fail("skin.binding_start", 0, std::to_string(skin.binding_start.front()), "must be 0");
  for (std::size_t v = 0; v < vertices; ++v) {
    const std::uint32_t from = skin.binding_start[v], to = skin.binding_start[v + 1];
    if (to <= from || to > skin.binding_knots.size()) {
      check.fail("skin.binding_start", v + 1, std::to_string(to), "must rise and stay within the bindings");
    }
    double sum = 0;
    for (std::uint32_t e = from; e < to; ++e) {
      check.knot("skin.binding_knots", e, skin.binding_knots[e]);
      if (!(std::abs(skin.binding_weights[e]) <= 1e3f))
        check.fail("skin.binding_weights", e, Check::text(static_cast<double>(skin.binding_weights[e])),
                   "must be from -1000 to 1000");
      sum += static_cast<double>(skin.binding_weights[e]);
    }
    if (!(std::abs(sum - 1) < 1e-4))
      check.fail("skin.binding_weights", v, "sum " + std::to_string(sum), "must sum to 1");
    for (const float c : skin.texture_coordinates[v]) {
      if (!std::isfinite(c)) check.fail("skin.texture_coordinates", v, std::to_string(c), "must be finite");
    }
  }
  check.size("skin.binding_start (last entry)", skin.binding_start.back(), skin.binding_knots.size());
  for (std::size_t t = 0; t < skin.triangles.size(); ++t) {
    for (const auto v : skin.triangles[t]) {
      if (v >= vertices)
        check.fail("skin.triangles", t, "vertex " + std::to_string(v), "must be a vertex of the skin");
    }
    const auto& k = skin.triangles[t];
    if (k[0] == k[1] || k[1] == k[2] || k[2] == k[0])
      check.fail("skin.triangles", t, "a corner twice", "must have three corners");
  }
}

/// Triangles that others touch: three corners each, none twice; where they are closed, seen from outside. Two
/// of a rigid object that share an edge look to the same side.
void checkSurface(const Object& object, const Check& check) {
  const auto& triangles = object.contact_triangles;
  std::set<std::array<Index, 3>> known;
  std::map<std::pair<Index, Index>, std::vector<std::size_t>> edges;  // of these triangles
  double six = 0;
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    std::array<Index, 3> t = triangles[i];
    if (t[0] == t[1] || t[1] == t[2] || t[2] == t[0])
      check.fail("contact_triangles", i, "knot " + std::to_string(t[0] == t[1] ? t[0] : t[2]) + " twice",
                 "must have three corners");
    std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
    if (!known.insert(t).second)
      check.fail("contact_triangles", i, "stands there twice", "must stand there once");
    for (std::size_t e = 0; e < 3; ++e) edges[{t[e], t[(e + 1) % 3]}].push_back(i);
    const Eigen::Vector3d o = object.rest_position[triangles[0][0]];
    six += (object.rest_position[t[0]] - o)
               .dot((object.rest_position[t[1]] - o).cross(object.rest_position[t[2]] - o));
  }
  bool open = false;  // it has two sides
  for (const auto& [edge, of] : edges) {
    if (edges.count({edge.second, edge.first}) > 0) continue;
    open = true;
    if (object.model == ObjectModel::Rigid && of.size() == 2)
      check.fail("contact_triangles", of[1], "turned against [" + std::to_string(of[0]) + "], its neighbour",
                 "must go round as its neighbours do");
  }
  if (!open && six < 0 && object.organ != "cavity")
    check.fail("contact_triangles", 0, "inside out, volume " + Check::text(six / 6),
               "must be counter-clockwise from outside (organ: cavity where one looks from within)");
}

}  // namespace

void checkObject(const Object& object, const std::string& file) {
  const Check check(object, file);
  const std::size_t knots = object.rest_position.size();
  if (knots == 0 || knots > 65535) {
    yaml::fail(file, 0, object.name + ".knots", std::to_string(knots), "must be 1 to 65535 knots");
  }
  for (const auto& [field, count, most] :
       {std::tuple{".links", object.links.size(), kMostLinks},
        {".contact_triangles", object.contact_triangles.size(), kMostTriangles}})
    if (count > most)
      yaml::fail(file, 0, object.name + field, std::to_string(count),
                 "must be at most " + std::to_string(most));
  check.size("position", object.position.size(), knots);
  check.size("mass", object.mass.size(), knots);
  check.size("damping", object.damping.size(), knots);
  check.size("fixed", object.fixed.size(), knots);
  for (std::size_t i = 0; i < knots; ++i) {
    check.place("rest_position", i, object.rest_position[i]);
    check.place("position", i, object.position[i]);
    check.number("mass", i, object.mass[i], kLeastMass, "must be at least 1e-30");
    if (object.fixed[i] > 1) check.fail("fixed", i, std::to_string(object.fixed[i]), "must be 0 or 1");
    check.number("damping", i, object.damping[i], 0, "must be >= 0");
  }
  std::set<std::tuple<int, Index, Index, Index>> known;
  for (std::size_t i = 0; i < object.links.size(); ++i) {
    const Link& link = object.links[i];
    check.knot("links", i, link.knot0);
    check.knot("links", i, link.knot1);
    const bool bending = link.kind == LinkKind::Bending;
    if (bending) check.knot("links", i, link.knot2);
    if (link.knot0 == link.knot1 || (bending && (link.knot2 == link.knot0 || link.knot2 == link.knot1))) {
      check.fail("links", i, "knot " + std::to_string(link.knot1) + " twice", "must join different knots");
    }
    if (!known.insert(linkKey(link)).second) {
      check.fail("links", i, std::to_string(link.knot0) + "-" + std::to_string(link.knot1),
                 "must not stand there twice");
    }
    const bool has_length = link.kind == LinkKind::Elastic || link.kind == LinkKind::Plastic;
    if (!(std::abs(link.rest) <= kFarthest) || (has_length && !(link.rest > 0))) {
      check.fail("links.rest_length", i, Check::text(link.rest), "must be > 0, at most 500000");
    }
    const double off = std::max(object.position[link.knot0].cwiseAbs().maxCoeff(),
                                object.position[link.knot1].cwiseAbs().maxCoeff());
    if (has_length && link.rest < kResolved * off) {
      check.fail("links.rest_length", i, Check::text(link.rest),
                 "must be at least " + Check::text(kResolved * off) + ": its knots lie " + Check::text(off) +
                     " from the origin, where single precision resolves no less");
    }
    check.number("links.area", i, link.area, 0, "must be >= 0");
    if (link.kind == LinkKind::Elastic && link.stiffness == 0)
      check.number("links: youngs_modulus * area / rest_length", i,
                   object.law.youngs_modulus * link.area / link.rest, 0, "must be >= 0");
    check.number("links.stiffness", i, link.stiffness, 0, "must be >= 0");
    check.number("links.damping", i, link.damping, 0, "must be >= 0");
  }
  for (std::size_t i = 0; i < object.tethers.size(); ++i) {
    check.knot("tethers", i, object.tethers[i].knot);
    check.place("tethers.place", i, object.tethers[i].place);
    check.number("tethers.stiffness", i, object.tethers[i].stiffness, 0, "must be >= 0");
    check.number("tethers.damping", i, object.tethers[i].damping, 0, "must be >= 0");
  }
  for (std::size_t i = 0; i < object.hinges.size(); ++i) {
    for (const Index knot : object.hinges[i].knots) check.knot("hinges", i, knot);
    check.number("hinges.stiffness", i, object.hinges[i].stiffness, 0, "must be >= 0");
  }
  for (std::size_t i = 0; i < object.contact_triangles.size(); ++i) {
    for (const Index knot : object.contact_triangles[i]) check.knot("contact_triangles", i, knot);
  }
  checkSurface(object, check);
  for (std::size_t i = 0; i < object.volumes.size(); ++i) {
    for (const auto& triangle : object.volumes[i].triangles) {
      for (const Index knot : triangle) check.knot("volumes", i, knot);
    }
    check.number("volumes.bulk_modulus", i, object.volumes[i].bulk_modulus, 0, "must be >= 0");
    check.number("volumes.rest_volume", i, object.volumes[i].rest_volume, 0, "must be >= 0");
  }
  for (std::size_t i = 0; i < object.tube.rings.size(); ++i) {
    for (const Index knot : object.tube.rings[i]) check.knot("tube.rings", i, knot);
    if (!std::isfinite(object.tube.station[i]) ||
        (i > 0 && object.tube.station[i] < object.tube.station[i - 1])) {
      check.fail("tube.station", i, std::to_string(object.tube.station[i]), "must be finite and ascending");
    }
  }
  checkSkin(object, check);
}

double wallSpacing(const Object& rigid) {
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& p : rigid.position) box.extend(p);
  return std::max(0.002, box.sizes().maxCoeff() / 160.0);
}

void checkCounts(const Description& description, const std::string& file) {
  std::size_t knots = 0, links = 0, triangles = 0;
  for (const Object& o : description.objects) {
    knots += o.position.size(), links += o.links.size(), triangles += o.contact_triangles.size();
    for (const auto& [what, count, most] : {std::tuple{"knots", knots, kMostKnots},
                                            {"links", links, kMostLinks},
                                            {"triangles that are touched", triangles, kMostTriangles}})
      if (count > most)
        yaml::fail(file, 0, o.name, "with it " + std::to_string(count) + " " + what,
                   "a scene may have " + std::to_string(most));
  }
}

void checkTogether(const Description& description, const std::string& file) {
  checkCounts(description, file);
  if (description.integrator != Integrator::NewtonEuler) return;
  const Eigen::Vector3d& g = description.gravity;
  if (!(g.cwiseAbs().maxCoeff() <= kMostGravity))
    yaml::fail(file, 0, "gravity", sizeText(g) + "/s²", "must be from -100 to 100 m/s² along each axis");
  Eigen::AlignedBox3d moves;
  for (const Object& o : description.objects)
    if (o.model != ObjectModel::Rigid)
      for (const Eigen::Vector3d& p : o.position) moves.extend(p);
  for (const Suture& s : description.sutures)
    for (const Eigen::Vector3d& p : s.rod.nodes) moves.extend(p);
  if (moves.isEmpty()) return;
  double points = 0, looks = 0;
  for (const Object& o : description.objects) {
    if (o.model != ObjectModel::Rigid || o.contact_triangles.empty()) continue;
    const double spacing = wallSpacing(o);
    const auto cost =
        contact::gridCost(o.position, o.contact_triangles, spacing, contact::kWallBand * spacing);
    points += cost.points, looks += cost.looks;
    for (const auto& [what, count, most] :
         {std::tuple{"points on which walls are felt", points, kMostWallPoints},
          {"looks from such a point at a triangle", looks, kMostWallLooks}})
      if (count > most)
        yaml::fail(file, 0, o.name, "with it " + Check::text(count) + " " + what,
                   "a scene may have " + Check::text(most) + ": fewer, smaller or thinner rigid objects");
    if (spacing <= std::max(0.002, moves.sizes().maxCoeff())) continue;
    Eigen::AlignedBox3d box;
    for (const Eigen::Vector3d& p : o.position) box.extend(p);
    yaml::fail(file, 0, o.name, sizeText(box.sizes()),
               "its walls are felt every " + Check::text(spacing) + " m, and all that moves is " +
                   sizeText(moves.sizes()) +
                   "; a rigid object may be 160 times as large as that, and 0.32 m");
  }
}

std::size_t countPieces(const Object& object) {
  std::vector<Index> parent(object.rest_position.size());
  std::iota(parent.begin(), parent.end(), Index{0});
  const auto root = [&](Index i) {
    while (parent[i] != i) i = parent[i] = parent[parent[i]];
    return i;
  };
  for (const Link& link : object.links) {
    if (link.kind == LinkKind::Elastic || link.kind == LinkKind::Plastic)
      parent[root(link.knot0)] = root(link.knot1);
  }
  std::size_t pieces = 0;
  for (Index i = 0; i < parent.size(); ++i) pieces += root(i) == i;
  return pieces;
}

std::size_t countUnboundKnots(const Object& object) {
  std::vector<bool> bound(object.rest_position.size(), false);
  for (std::size_t e = 0; e < object.skin.binding_knots.size(); ++e) {
    if (object.skin.binding_weights[e] != 0) bound[object.skin.binding_knots[e]] = true;
  }
  return static_cast<std::size_t>(std::count(bound.begin(), bound.end(), false));
}

std::size_t countDuplicateLinks(const Object& object) {
  std::set<std::tuple<int, Index, Index, Index>> known;
  std::size_t duplicates = 0;
  for (const Link& link : object.links) duplicates += !known.insert(linkKey(link)).second;
  return duplicates;
}

}  // namespace vest::scene
