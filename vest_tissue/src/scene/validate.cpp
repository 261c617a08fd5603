#include <algorithm>
#include <cmath>
#include <set>
#include <sstream>
#include <stdexcept>
#include <tuple>

#include "vest_tissue/scene/fem_object.h"
#include "vest_tissue/scene/world_model.h"

namespace vest::scene {
namespace {

[[noreturn]] void refuse(const std::string& where, const std::string& value, const std::string& allowed) {
  throw std::invalid_argument(where + ": " + value + " (" + allowed + ")");
}

std::string text(double value) {
  std::ostringstream out;
  out << value;
  return out.str();
}

/// Checks of one object; `path` is "object 'name'".
struct Checker {
  const Object& object;
  std::string path;
  std::size_t knots;

  std::string item(const char* field, std::size_t index, const char* member = "") const {
    return path + ": " + field + "[" + std::to_string(index) + "]" + member;
  }
  void finite(const char* field, std::size_t i, const Eigen::Vector3d& v) const {
    if (!v.allFinite())
      refuse(item(field, i), text(v.x()) + " " + text(v.y()) + " " + text(v.z()), "finite numbers, m");
  }
  void atLeast(const std::string& where, double value, double least, bool open, const char* unit) const {
    if (!std::isfinite(value) || value < least || (open && value == least)) {
      refuse(where, text(value), std::string(open ? "> " : ">= ") + text(least) + ", finite, " + unit);
    }
  }
  void knot(const std::string& where, std::size_t index) const {
    if (index >= knots)
      refuse(where, std::to_string(index), "a knot of the object, 0 … " + std::to_string(knots - 1));
  }
  void size(const char* field, std::size_t is, std::size_t wanted) const {
    if (is != wanted)
      refuse(path + ": " + field, std::to_string(is) + " entries", std::to_string(wanted) + ", one per knot");
  }
};

void checkLinks(const Checker& c) {
  std::set<std::tuple<int, Index, Index, Index>> seen;
  for (std::size_t i = 0; i < c.object.links.size(); ++i) {
    const Link& l = c.object.links[i];
    c.knot(c.item("links", i, ".knot0"), l.knot0);
    c.knot(c.item("links", i, ".knot1"), l.knot1);
    if (l.kind == LinkKind::Bending) c.knot(c.item("links", i, ".knot2"), l.knot2);
    const Index end = l.kind == LinkKind::Bending ? l.knot2 : l.knot1;
    if (l.knot0 == l.knot1 || l.knot0 == end || (l.kind == LinkKind::Bending && l.knot1 == l.knot2)) {
      refuse(c.item("links", i), "joins knot " + std::to_string(l.knot0) + " to itself", "different knots");
    }
    const Index middle = l.kind == LinkKind::Bending ? l.knot1 : 0;
    if (!seen.insert({static_cast<int>(l.kind), std::min(l.knot0, end), std::max(l.knot0, end), middle})
             .second) {
      refuse(c.item("links", i),
             "joins knots " + std::to_string(l.knot0) + " and " + std::to_string(end) + " a second time",
             "one link of a kind between two knots");
    }
    c.atLeast(c.item("links", i, ".damping"), l.damping, 0.0, false, "N·s/m");
    c.atLeast(c.item("links", i, ".stiffness"), l.stiffness, 0.0, false, "by kind: N/m, N, N·m/rad");
    c.atLeast(c.item("links", i, ".area"), l.area, 0.0, false, "m²");
    if (l.kind == LinkKind::Elastic || l.kind == LinkKind::Plastic) {
      c.atLeast(c.item("links", i, ".rest"), l.rest, 0.0, true, "m");
    } else {
      c.atLeast(c.item("links", i, ".rest"), l.rest, 0.0, false, "rad");
    }
  }
}

void checkNet(const Checker& c) {
  const Object& o = c.object;
  c.size("rest_position", o.rest_position.size(), c.knots);
  c.size("mass", o.mass.size(), c.knots);
  if (!o.damping.empty()) c.size("damping", o.damping.size(), c.knots);
  if (!o.fixed.empty()) c.size("fixed", o.fixed.size(), c.knots);
  for (std::size_t i = 0; i < c.knots; ++i) {
    c.finite("rest_position", i, o.rest_position[i]);
    c.atLeast(c.item("mass", i), o.mass[i], 0.0, true, "kg");
    if (!o.damping.empty()) c.atLeast(c.item("damping", i), o.damping[i], 0.0, false, "N·s/m");
  }
  const bool by_law = std::any_of(o.links.begin(), o.links.end(), [](const Link& l) {
    return l.kind == LinkKind::Elastic && l.stiffness == 0.0;
  });
  if (by_law) {
    c.atLeast(c.path + ": law.youngs_modulus", o.law.youngs_modulus, 0.0, true, "Pa");
    c.atLeast(c.path + ": law.max_strain", o.law.max_strain, 0.0, true, "no unit");
    if (!material::isMonotone(o.law)) {
      refuse(c.path + ": law", "a2 " + text(o.law.a2) + ", a3 " + text(o.law.a3) + ", a4 " + text(o.law.a4),
             "a stress that rises over 0 … max_strain " + text(o.law.max_strain));
    }
  }
  checkLinks(c);
  for (std::size_t i = 0; i < o.volumes.size(); ++i) {
    for (const auto& t : o.volumes[i].triangles)
      for (const Index k : t) c.knot(c.item("volumes", i, ".triangles"), k);
    c.atLeast(c.item("volumes", i, ".bulk_modulus"), o.volumes[i].bulk_modulus, 0.0, false, "Pa");
    c.atLeast(c.item("volumes", i, ".rest_volume"), o.volumes[i].rest_volume, 0.0, false, "m³");
  }
  for (std::size_t i = 0; i < o.hinges.size(); ++i) {
    for (const Index k : o.hinges[i].knots) c.knot(c.item("hinges", i, ".knots"), k);
    c.atLeast(c.item("hinges", i, ".stiffness"), o.hinges[i].stiffness, 0.0, false, "N·m");
  }
  for (std::size_t i = 0; i < o.tethers.size(); ++i) {
    c.knot(c.item("tethers", i, ".knot"), o.tethers[i].knot);
    c.finite("tethers", i, o.tethers[i].place);
    c.atLeast(c.item("tethers", i, ".stiffness"), o.tethers[i].stiffness, 0.0, false, "N/m");
    c.atLeast(c.item("tethers", i, ".damping"), o.tethers[i].damping, 0.0, false, "N·s/m");
  }
}

void checkSkin(const Checker& c) {
  const Skin& s = c.object.skin;
  if (s.binding_start.empty()) return;
  if (s.binding_start.front() != 0 || s.binding_start.back() != s.binding_knots.size() ||
      s.binding_knots.size() != s.binding_weights.size() ||
      !std::is_sorted(s.binding_start.begin(), s.binding_start.end())) {
    refuse(c.path + ": skin.binding_start", "does not fit binding_knots and binding_weights",
           "ascending from 0 to their size");
  }
  for (std::size_t i = 0; i < s.binding_knots.size(); ++i) {
    c.knot(c.item("skin.binding_knots", i), s.binding_knots[i]);
    if (!std::isfinite(s.binding_weights[i]))
      refuse(c.item("skin.binding_weights", i), "not finite", "finite, no unit");
  }
  const std::size_t vertices = s.binding_start.size() - 1;
  for (std::size_t i = 0; i < s.triangles.size(); ++i) {
    for (const auto v : s.triangles[i]) {
      if (v >= vertices)
        refuse(c.item("skin.triangles", i), std::to_string(v),
               "a vertex, 0 … " + std::to_string(vertices - 1));
    }
  }
}

void checkConnections(const Description& d) {
  const auto find = [&](const std::string& name, const std::string& where) -> const Object& {
    for (const Object& o : d.objects)
      if (o.name == name) return o;
    refuse(where, "'" + name + "'", "the name of an object of the scene");
  };
  for (std::size_t i = 0; i < d.connections.size(); ++i) {
    const Connection& k = d.connections[i];
    const std::string at = "connections[" + std::to_string(i) + "]";
    const Object& a = find(k.object0, at + ".object0");
    const Object& b = find(k.object1, at + ".object1");
    const auto knot = [&](const Object& o, Index index, const char* field) {
      if (index >= o.position.size()) {
        refuse(at + field, std::to_string(index),
               "a knot of '" + o.name + "', 0 … " + std::to_string(o.position.size() - 1));
      }
    };
    knot(a, k.knot0, ".knot0");
    double sum = 0.0;
    for (int c = 0; c < 3; ++c) {
      knot(b, k.triangle1[c], ".triangle1");
      sum += k.weights1[c];
    }
    if (!(std::fabs(sum - 1.0) < 1e-4)) refuse(at + ".weights1", "sum " + text(sum), "barycentric, sum 1");
    if (!k.offset.allFinite()) refuse(at + ".offset", "not finite", "finite numbers, m");
    for (const auto& [value, field] : {std::pair{k.stiffness, ".stiffness"}, std::pair{k.damping, ".damping"},
                                       std::pair{k.break_force, ".break_force"}}) {
      if (!(value >= 0.0) || !std::isfinite(value)) refuse(at + field, text(value), ">= 0, finite");
    }
  }
}

}  // namespace

void validate(const Description& d) {
  if (!d.gravity.allFinite()) refuse("gravity", "not finite", "finite numbers, m/s²");
  if (!(d.dt >= 1e-6 && d.dt <= 0.01)) refuse("dt", text(d.dt), "1e-6 … 0.01 s");
  if (d.objects.empty()) refuse("objects", "none", "at least one");
  if (d.objects.size() > 1000) refuse("objects", std::to_string(d.objects.size()), "at most 1000");
  std::set<std::string> names;
  for (std::size_t n = 0; n < d.objects.size(); ++n) {
    const Object& o = d.objects[n];
    const std::string path = "object '" + o.name + "'";
    if (o.name.empty()) refuse("objects[" + std::to_string(n) + "].name", "empty", "a name");
    if (!names.insert(o.name).second) refuse(path, "occurs twice", "names that differ");
    const bool elements = o.model == ObjectModel::Fem || o.model == ObjectModel::Volume;
    if (elements != static_cast<bool>(o.fem))
      refuse(path + ": model", elements ? "fem or volume without tetrahedra" : "net or rigid with tetrahedra",
             "tetrahedra for fem and volume alone");
    const std::size_t nodes = elements ? knotsOf(*o.fem) : 0;
    if (elements && (nodes != o.position.size() || !o.links.empty()))
      refuse(path + ": position", std::to_string(o.position.size()) + " knots",
             std::to_string(nodes) + ", the nodes of its tetrahedra, and no links");
    if (o.position.empty()) refuse(path + ": position", "no knots", "at least one");
    if (o.position.size() > 1000000)
      refuse(path + ": position", std::to_string(o.position.size()) + " knots", "at most 1000000");
    const Checker c{o, path, o.position.size()};
    for (std::size_t i = 0; i < c.knots; ++i) c.finite("position", i, o.position[i]);
    if (o.model != ObjectModel::Rigid) checkNet(c);
    for (std::size_t i = 0; i < o.contact_triangles.size(); ++i) {
      for (const Index k : o.contact_triangles[i]) c.knot(c.item("contact_triangles", i), k);
    }
    c.atLeast(path + ": contact_thickness", o.contact_thickness, 0.0, false, "m");
    c.atLeast(path + ": tear_strain", o.tear_strain, 0.0, false, "no unit; 0: never");
    c.atLeast(path + ": cut_toughness", o.cut_toughness, 0.0, false, "J/m²");
    c.atLeast(path + ": puncture_force", o.puncture_force, 0.0, false, "N");
    c.atLeast(path + ": wall_thickness", o.wall_thickness, 0.0, false, "m; 0: solid");
    c.atLeast(path + ": friction", o.friction, 0.0, false, "no unit");
    if (!o.knot_perfusion.empty() && o.knot_perfusion.size() != c.knots)
      refuse(path + ": knot_perfusion", std::to_string(o.knot_perfusion.size()) + " entries",
             "none, or one per knot");
    for (std::size_t i = 0; i < o.knot_perfusion.size(); ++i)
      c.atLeast(c.item("knot_perfusion", i), o.knot_perfusion[i], 0.0, false, "1/s");
    checkSkin(c);
    if (o.tube.station.size() != o.tube.rings.size()) {
      refuse(path + ": tube.station", std::to_string(o.tube.station.size()) + " entries", "one per ring");
    }
    for (std::size_t r = 0; r < o.tube.rings.size(); ++r) {
      if (!std::isfinite(o.tube.station[r]) || (r > 0 && o.tube.station[r] < o.tube.station[r - 1])) {
        refuse(c.item("tube.station", r), text(o.tube.station[r]), "finite and ascending, m");
      }
      for (const Index k : o.tube.rings[r]) c.knot(c.item("tube.rings", r), k);
    }
  }
  checkConnections(d);
}

}  // namespace vest::scene
