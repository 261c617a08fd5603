#include "snapshot_check.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <stdexcept>

namespace vest::scene::snapshot {
namespace {

constexpr double kFarthestPlace = 1e6, kFastest = 1e3;  // m, m/s: beyond them a step is a FAULT
constexpr int kMostSubSteps = 4096;                     // of an object in a step (assumed)

std::string number(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%g", value);
  return text;
}

template <class Values>
void bounded(const char* what, const Values& values, std::size_t count, double least, double most) {
  for (std::size_t i = 0; i < count; ++i) {
    const auto value = static_cast<double>(values[i]);
    if (!(value >= least && value <= most))
      refuse(std::string(what) + " of " + number(value) + " (allowed: " + number(least) + " to " +
             number(most) + ")");
  }
}

void place(const char* what, const Eigen::Vector3d& x) {
  bounded(what, x.data(), 3, -kFarthestPlace, kFarthestPlace);
}

/// One object, with its numbers at hand.
struct Object {
  const ObjectState& s;
  const ObjectState& start;
  const ObjectConstants& constants;

  std::size_t knots() const { return s.block.knots(); }
  std::size_t vertices() const { return s.topology.skin.texture_coordinates.size(); }

  void knot(std::uint64_t k) const {
    if (k >= knots()) refuse("knot " + std::to_string(k) + " of an object with " + std::to_string(knots()));
  }
  void contact(std::uint64_t t) const {
    if (t >= s.triangles.size())
      refuse("contact triangle " + std::to_string(t) + " of an object with " +
             std::to_string(s.triangles.size()));
  }
  void below(const char* what, std::uint64_t index, std::size_t count, bool none_allowed = false) const {
    if (index < count || (none_allowed && index == interaction::kNone)) return;
    refuse(std::string(what) + " " + std::to_string(index) + " of " + std::to_string(count));
  }

  void numbers() const {
    using net::Block;
    for (const auto r : {Block::X, Block::Y, Block::Z})
      bounded("a coordinate", s.block.row(r), knots(), -kFarthestPlace, kFarthestPlace);
    for (const auto r : {Block::VX, Block::VY, Block::VZ})
      bounded("a velocity", s.block.row(r), knots(), -kFastest, kFastest);
    for (const auto r : {Block::kInverseMass, Block::kDecay, Block::kMass})
      bounded("a mass or decay", s.block.row(r), knots(), 0.0, 1e38);
    for (const double scale : {s.elastic_scale, s.damping_scale, s.tissue.stiffness_scale})
      bounded("a parameter", &scale, 1, 0.0, 1e9);
    bounded("a phase of motility", s.motility.phase.data(), 2, -1e9, 1e9);
    bounded("a strain", &s.limit_strain, 1, 0.0, 1e9);
    int doubled = constants.batches;
    while (doubled < s.batches && doubled <= kMostSubSteps) doubled *= 2;
    if (s.batches != doubled) refuse(std::to_string(s.batches) + " exchanges of an object");
    if (s.sub_steps < 1 || s.sub_steps > std::max(kMostSubSteps, start.sub_steps) ||
        s.sub_steps % s.batches != 0)
      refuse(std::to_string(s.sub_steps) + " sub-steps of an object");
  }

  void loads() const {
    if (!s.load.any) return;
    for (const auto* load : {&s.load.now, &s.load.told}) {
      for (std::size_t k = 0; k < knots(); ++k) {
        bounded("a load, N,", (*load)[k].data(), 3, static_cast<double>(-kGreatestLoad),
                static_cast<double>(kGreatestLoad));
        bounded("a load's damping", (*load)[k].data() + 3, 1, 0.0, static_cast<double>(kGreatestLoadDamping));
        bounded("a load's stiffness", (*load)[k].data() + 4, 1, static_cast<double>(-kGreatestLoadStiffness),
                static_cast<double>(kGreatestLoadStiffness));
        bounded("a load's level", (*load)[k].data() + 5, 1, static_cast<double>(-kGreatestLoadLevel),
                static_cast<double>(kGreatestLoadLevel));
      }
    }
    bounded("a load that comes within s:", &s.load.left, 1, 0.0, kLongestLoad);
  }

  void elements() const {
    for (const auto& b : s.elements.bending) knot(b.a), knot(b.b), knot(b.c);
    for (const auto& h : s.elements.hinges) knot(h.edge0), knot(h.edge1), knot(h.wing0), knot(h.wing1);
    for (const auto& p : s.elements.plastic) knot(p.a), knot(p.b);
    for (const auto& t : s.elements.tethers) knot(t.knot);
    for (const auto& v : s.elements.volumes) {
      // A cut body lists all of its knots: those of a surface that was cut away are not looked for.
      const std::set<std::uint32_t> known(v.knots.begin(), v.knots.end());
      for (const auto k : v.knots) knot(k);
      for (const auto& t : v.triangles)
        for (const auto k : t)
          if (known.count(k) == 0)
            refuse("a triangle of an enclosed volume with a knot that is not the volume's");
    }
  }

  void topology() const {
    const Topology& t = s.topology;
    if (t.link_alive.size() != t.links.size() || s.places.size() != t.links.size() ||
        t.triangle_alive.size() != t.skin.triangles.size() || s.triangle_alive.size() != s.triangles.size() ||
        s.fixed.size() != knots() || s.depth.size() != s.block.knotCapacity())
      refuse("lists of an object that do not fit each other");
    if (!constants.fem && s.triangles.size() != start.triangles.size())
      refuse(std::to_string(s.triangles.size()) + " contact triangles (the scene has " +
             std::to_string(start.triangles.size()) + ")");
    for (const auto& triangle : s.triangles)
      for (const auto k : triangle) knot(k);
    for (std::size_t i = 0; i < t.links.size(); ++i) {
      below("a kind of link", static_cast<std::uint8_t>(t.links[i].kind), 4);
      knot(t.links[i].knot0), knot(t.links[i].knot1), knot(t.links[i].knot2);
      const auto kind = s.places[i].kind;
      below("a kind of link", static_cast<std::uint8_t>(kind), 4);
      below("the place of a link", s.places[i].index,
            kind == LinkKind::Plastic   ? s.elements.plastic.size()
            : kind == LinkKind::Bending ? s.elements.bending.size()
                                        : s.links.size());
    }
    for (const auto k : t.doubled_knots) knot(k);
    skin(t.skin);
  }

  void skin(const Skin& k) const {
    const std::size_t rows = k.binding_start.empty() ? 0 : k.binding_start.size() - 1;
    if (rows != vertices() || k.binding_weights.size() != k.binding_knots.size() ||
        k.layer.size() != k.triangles.size() ||
        (rows > 0 && (k.binding_start.front() != 0 || k.binding_start.back() != k.binding_knots.size())) ||
        !std::is_sorted(k.binding_start.begin(), k.binding_start.end()))
      refuse("lists of a skin that do not fit each other");
    for (const auto b : k.binding_knots) knot(b);
    for (const auto& triangle : k.triangles)
      for (const auto v : triangle) below("vertex", v, rows);
  }

  void cut() const {
    const interaction::CutState& c = s.cut;
    for (const auto& x : c.crossings)
      contact(x.triangle), below("edge", x.edge, 3), below("corner", x.knot, 4);
    for (const auto& x : c.tracks) contact(x.triangle), knot(x.knots[0]), knot(x.knots[1]);
    if (c.line.empty() != start.cut.line.empty()) refuse("a cut of an object that cannot be cut");
    if (c.line.empty()) return;
    const std::size_t is = c.rest.size(), triangles = s.topology.skin.triangles.size();
    const auto same = [&](std::size_t size) { return size == is; };
    if (c.line.size() != s.triangles.size() || c.inward.size() != s.block.knotCapacity() ||
        (is > 0 && (c.home.size() != triangles || c.open.size() != triangles || is != vertices())) ||
        (is == 0 && !start.cut.rest.empty()) || !same(c.lies_on.size()) || !same(c.free.size()) ||
        !same(c.outer.size()) || !same(c.inner.size()) || !same(c.wall.size()))
      refuse("lists of a cut that do not fit each other");
    for (const auto t : c.lies_on) contact(t);
    for (const auto t : c.home)
      if (t != interaction::kNone) contact(t);
    for (const auto* of : {&c.outer, &c.inner, &c.wall})
      for (const auto v : *of) below("vertex", v, is, true);
    for (const auto& f : c.faces) {
      below("skin triangle", f.skin_triangle, triangles), below("edge", f.edge, 4);
      for (const auto t : f.built) below("skin triangle", t, triangles, true);
    }
  }

  void tissue() const {
    const fem::TissueState& e = s.tissue;
    if (e.x.empty() != start.tissue.x.empty())
      refuse("an object that has turned into finite elements, or back");
    if (e.x.empty()) return;
    const std::size_t count = e.x.size(), elements = start.tissue.corner.size();
    if (count != knots() || e.v.size() != count || e.mass.size() != count || e.origin.size() != count ||
        e.knot_element.size() != count || e.corner.size() != elements || e.open.size() != elements ||
        (!e.denatured.empty() && e.denatured.size() != elements))
      refuse("finite elements whose lists do not fit each other");
    for (const auto& x : e.x) place("a coordinate", x);
    for (const auto& v : e.v) bounded("a velocity", v.data(), 3, -kFastest, kFastest);
    bounded("a mass", e.mass, count, 0.0, 1e30);
    for (const auto& c : e.corner)
      for (const auto k : c) knot(k);
    for (std::size_t k = 0; k < count; ++k) {
      below("an origin", e.origin[k], std::min(k + 1, start.tissue.x.size()));
      below("an element", e.knot_element[k], elements);
    }
    const FemSurface& f = s.fem_surface;
    if (f.triangle_face.size() != s.triangles.size() ||
        f.skin_face.size() != s.topology.skin.triangles.size() || f.knot_vertex.size() != count ||
        f.vertex_element.size() != vertices())
      refuse("a surface of finite elements whose lists do not fit each other");
    for (const auto code : f.triangle_face) below("a face", code, 4 * elements);
    for (const auto code : f.skin_face) below("a face", code, 4 * elements, true);
    for (const auto v : f.knot_vertex) below("vertex", v, vertices(), true);
    for (const auto v : f.vertex_element) below("an element", v, elements, true);
  }

  void check() const { numbers(), loads(), topology(), elements(), cut(), tissue(); }
};

/// What names knots and triangles of several objects.
struct Whole {
  const WorldState& s;
  const WorldModel& model;

  void object(std::size_t index) const {
    if (index >= s.objects.size())
      refuse("object " + std::to_string(index) + " of " + std::to_string(s.objects.size()));
  }
  void knot(std::size_t of, std::uint64_t k) const {
    object(of);
    if (k >= s.objects[of].block.knots()) refuse("an anchor outside the scene");
  }
  void triangle(std::size_t of, std::uint64_t t) const {
    object(of);
    if (t >= s.objects[of].triangles.size() && t != 0) refuse("a contact outside the scene");
  }
  void instrument(int index) const {
    if (index < -1 || index >= tools::kInstrumentCount) refuse("instrument " + std::to_string(index));
  }

  void tools() const {
    for (const auto& p : s.proxies) {
      if (static_cast<int>(p.tool) >= tools::kToolKindCount)
        refuse("kind of tool " + std::to_string(static_cast<int>(p.tool)));
      place("a tool's place", p.pose.tip), place("a tool's place", p.pose.pivot);
      place("a tool's place", p.commanded);
      bounded("a tool's velocity", p.velocity.data(), 3, -kFastest, kFastest);
      bounded("a jaw's angle", &p.pose.jaw, 1, -10.0, 10.0);
      const double norm = p.pose.orientation.norm();
      bounded("length of a quaternion", &norm, 1, 0.9, 1.1);
    }
    for (const auto& g : s.grasps) {
      if (g.count < 0 || g.count > interaction::kMaxGraspAnchors) refuse("number of grasped knots");
      for (int i = 0; i < g.count; ++i) knot(g.anchors[i].object, g.anchors[i].knot);
      if (g.count > 0) triangle(g.anchors[0].object, g.element);
    }
    for (const auto& e : s.electrosurgery.electrodes) knot(e.object, 0), triangle(e.object, e.element);
    for (const auto& t : s.cutting.tools) triangle(t.object, t.element);
    for (const auto& p : s.sides) {
      triangle(p.object, p.triangle), instrument(p.tool);
      if (p.capsule >= interaction::kMaxToolCapsules) refuse("capsule " + std::to_string(p.capsule));
    }
  }

  void fasteners() const {
    if (s.fasteners.clips.size() > interaction::kMaxClips ||
        s.fasteners.slings.size() > interaction::kMaxSlings)
      refuse("too many clips or slings");
    for (const auto& f : s.fasteners.clips) {
      instrument(f.instrument);
      if (f.ring > f.count) refuse("a clip's ring of " + std::to_string(f.ring) + " knots");
      place("a clip's place", f.centre);
      for (int i = 0; i < f.count; ++i) {
        if (f.alive) knot(f.object, f.knots[i]);
        place("a clip's knot", f.open[i]), place("a clip's knot", f.closed[i]);
      }
      object(f.object);
    }
    for (const auto& f : s.fasteners.slings) {
      object(f.object), instrument(f.instrument);
      if (f.alive && f.instrument < 0) refuse("a sling without instrument");
      const auto& tube = model.description.objects[f.object].tube;
      if (f.ring < -1 || f.ring >= static_cast<std::int64_t>(tube.rings.size()))
        refuse("ring " + std::to_string(f.ring) + " of a sling");
      for (int i = 0; f.alive && i < f.count; ++i) knot(f.object, f.knots[i]);
      for (const auto& x : f.node) place("a sling's place", x);
      for (const auto& v : f.velocity) bounded("a sling's velocity", v.data(), 3, -kFastest, kFastest);
      place("a sling's place", f.tip);
      bounded("a sling's length", &f.rest, 1, 0.0, 10.0);
      for (const auto& touch : f.touch)
        for (const auto k : touch.knots)
          if (f.alive && touch.on) knot(touch.object, k);
    }
  }

  void check() const {
    bounded("gravity", s.gravity.data(), 3, -1e4, 1e4);
    for (const auto& c : s.connections) {
      for (const auto k : c.end0.knots) knot(c.end0.object, k);
      for (const auto k : c.end1.knots) knot(c.end1.object, k);
    }
    for (const auto& p : s.pairs) {
      knot(p.object, p.knot), knot(p.other, 0);
      if (p.triangle >= s.objects[p.other].triangles.size()) refuse("a contact outside the scene");
    }
    tools(), fasteners();
  }
};

}  // namespace

void refuse(const std::string& what) {
  throw std::invalid_argument("snapshot: " + what);
}

void check(const WorldState& state, const WorldModel& model) {
  for (std::size_t i = 0; i < state.objects.size(); ++i)
    Object{state.objects[i], model.start.objects[i], model.objects[i]}.check();
  Whole{state, model}.check();
}

}  // namespace vest::scene::snapshot
