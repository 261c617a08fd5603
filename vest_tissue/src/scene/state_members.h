#pragma once

#include <algorithm>
#include <set>

#include "state_fields.h"

/// Members of everything in WorldState, each named once. A struct that gets one more member does not compile
/// until it stands here.
namespace vest::scene {

inline constexpr double kFarthest = 1e6, kFastest = 1e3;  ///< m, m/s: beyond these a step is a FAULT
inline constexpr int kMostSubSteps = 4096;                ///< of an object in a step (assumed)

template <class T>
Rule<T> place(const char* what, T& v) {
  return within(what, v, -kFarthest, kFarthest);
}
template <class T>
Rule<T> speed(const char* what, T& v) {
  return within(what, v, -kFastest, kFastest);
}
inline constexpr double kMost = std::numeric_limits<double>::max();

template <class A>
auto fields(Walk<A> a, net::KernelLink& l) {
  const auto& at = a.archive.at;
  return a(index("knot", l.knot0, at.knots()), index("knot", l.knot1, at.knots()),
           within("a rest length", l.rest, 1e-30, 1e30), within("an axial force", l.axial, 0.0, kMost),
           within("a damping", l.damping, 0.0, kMost));
}
template <class A>
auto fields(Walk<A> a, NetLink& l) {
  return a(l.values, l.by_law, l.place, l.shrink, l.stiffen,
           within("a conductance", l.conductance, 0.0, 1e9));
}
template <class A>
auto fields(Walk<A> a, Link& l) {
  const auto& at = a.archive.at;
  return a(index("a kind of link", l.kind, 4), index("knot", l.knot0, at.knots()),
           index("knot", l.knot1, at.knots()), index("knot", l.knot2, at.knots()), l.rest, l.area,
           l.stiffness, l.damping);
}
template <class A>
auto fields(Walk<A> a, LinkPlace& p) {
  const auto& s = a.archive.at.now();
  return a(index("a kind of link", p.kind, 4))(index("the place of a link", p.index,
                                                     p.kind == LinkKind::Plastic   ? s.elements.plastic.size()
                                                     : p.kind == LinkKind::Bending ? s.elements.bending.size()
                                                                                   : s.links.size()));
}

template <class A>
auto fields(Walk<A> a, Skin& k) {
  const auto& at = a.archive.at;
  return a(k.binding_start, index("knot", k.binding_knots, at.knots()),
           rule(k.binding_weights).sized(k.binding_knots.size()), k.texture_coordinates,
           index("vertex", k.triangles, at.vertices()), k.layer)
      .require(k.layer.size() == k.triangles.size() && k.binding_weights.size() == k.binding_knots.size() &&
                   std::max<std::size_t>(k.binding_start.size(), 1) == at.vertices() + 1 &&
                   (k.binding_start.empty() ||
                    (k.binding_start.front() == 0 && k.binding_start.back() == k.binding_knots.size())) &&
                   std::is_sorted(k.binding_start.begin(), k.binding_start.end()),
               "lists of a skin that do not fit each other");
}
/// A knot is a copy of one before it: else the way back to the scene's knot would not end.
inline bool copiesFollow(const std::vector<std::uint32_t>& doubled, std::size_t scene_knots) {
  for (std::size_t i = 0; i < doubled.size(); ++i)
    if (doubled[i] >= scene_knots + i) return false;
  return true;
}
/// Cutting has room for so many vertices and triangles of the skin.
inline bool fitsCut(const Skin& skin, const interaction::CutConstants& c) {
  return !c.possible ||
         (skin.texture_coordinates.size() <= c.most_vertices && skin.triangles.size() <= c.most_triangles);
}
template <class A>
auto fields(Walk<A> a, Topology& t) {
  const auto& at = a.archive.at;
  const std::size_t scene_knots = at.start().block.knots();
  return a(t.revision, t.links, t.link_alive, t.skin, t.triangle_alive,
           index("knot", t.doubled_knots, at.knots()).sized(at.knots() - scene_knots))
      .require(!A::checks || copiesFollow(t.doubled_knots, scene_knots),
               "a knot that is a copy of a later one")
      .require(fitsCut(t.skin, at.constants().cut), "a skin with more than a cut has room for")
      .require(t.link_alive.size() == t.links.size() && t.triangle_alive.size() == t.skin.triangles.size(),
               "lists of an object that do not fit each other");
}

template <class A>
auto fields(Walk<A> a, net::Bending& e) {
  const std::size_t n = a.archive.at.knots();
  return a(index("knot", e.a, n), index("knot", e.b, n), index("knot", e.c, n), e.stiffness, e.rest);
}
template <class A>
auto fields(Walk<A> a, net::Hinge& e) {
  const std::size_t n = a.archive.at.knots();
  return a(index("knot", e.edge0, n), index("knot", e.edge1, n), index("knot", e.wing0, n),
           index("knot", e.wing1, n), e.stiffness, e.rest, e.least);
}
template <class A>
auto fields(Walk<A> a, net::Plastic& e) {
  const std::size_t n = a.archive.at.knots();
  return a(index("knot", e.a, n), index("knot", e.b, n), e.kappa, e.rest, e.damping);
}
template <class A>
auto fields(Walk<A> a, net::Tether& e) {
  return a(index("knot", e.knot, a.archive.at.knots()), e.place, e.stiffness, e.damping);
}
/// A cut body lists all of its knots: those of a surface that was cut away are not looked for.
inline bool knowsItsKnots(const net::Volume& e) {
  const std::set<std::uint32_t> known(e.knots.begin(), e.knots.end());
  for (const auto& t : e.triangles)
    for (const auto k : t)
      if (known.count(k) == 0) return false;
  return true;
}
template <class A>
auto fields(Walk<A> a, net::Volume& e) {
  const std::size_t n = a.archive.at.knots();
  return a(index("knot", e.triangles, n), index("knot", e.knots, n), e.bulk_modulus, e.rest)
      .require(!A::checks || knowsItsKnots(e),
               "a triangle of an enclosed volume with a knot that is not its");
}
template <class A>
auto fields(Walk<A> a, net::Elements& e) {
  return a(e.bending, e.hinges, e.plastic, e.tethers, e.volumes);
}

/// A vertex in an element hangs on its four corners.
inline bool hangsInElements(const std::vector<std::uint32_t>& element, const Skin& skin) {
  for (std::size_t v = 0; v < element.size(); ++v)
    if (element[v] != interaction::kNone && skin.binding_start[v + 1] - skin.binding_start[v] != 4)
      return false;
  return true;
}
template <class A>
auto fields(Walk<A> a, FemSurface& f) {
  const auto& at = a.archive.at;
  return a(index("a face", f.triangle_face, 4 * at.elements()).sized(at.triangles()),
           index("a face", f.skin_face, 4 * at.elements()).orNone().sized(at.skinTriangles()),
           index("vertex", f.knot_vertex, at.vertices()).orNone().sized(at.knots()),
           index("an element", f.vertex_element, at.elements()).orNone().sized(at.vertices()), f.parts)
      .require(!A::checks || hangsInElements(f.vertex_element, at.now().topology.skin),
               "a vertex in an element that does not hang on its corners");
}
/// Motion first: what follows is shape.
template <class A>
auto fields(Walk<A> a, fem::TissueState& t) {
  const auto& at = a.archive.at;
  const std::size_t knots = t.x.size(), elements = at.elements();
  const fem::TissueState& start = at.start().tissue;
  return a(place("a coordinate", t.x), speed("a velocity", t.v).sized(knots),
           within("a parameter", t.stiffness_scale, 0.0, 1e9), t.factored)
      .shape([&](auto b) {
        return b(t.denatured, t.revision).when(t.revision > 0, [&](auto d) {
          return d(within("a mass", t.mass, 0.0, 1e30).sized(knots),
                   index("knot", t.corner, at.knots()).sized(elements), rule(t.open).sized(elements),
                   index("an origin", t.origin, start.x.size()).sized(knots),
                   index("an element", t.knot_element, elements).sized(knots));
        });
      })
      .require(t.denatured.empty() || t.denatured.size() == elements,
               "finite elements whose lists do not fit each other")
      .require(t.revision > 0 || knots == start.x.size(), "knots of finite elements that no cut has made")
      .require(!t.factored || !at.constants().fem || !at.constants().fem->condensed(),
               "finite elements that are changed, whose inside the scene condenses")
      .require(t.factored || (!start.factored && t.revision == 0),
               "finite elements as built that the scene lets move, or that are cut");
}

inline bool bounded(const std::vector<HeldLoad::Of>& loads) {
  return std::all_of(loads.begin(), loads.end(), [](const HeldLoad::Of& f) {
    return std::all_of(f.begin(), f.begin() + 3, [](float n) { return std::fabs(n) <= kGreatestLoad; }) &&
           f[HeldLoad::kDamping] >= 0.0f && f[HeldLoad::kDamping] <= kGreatestLoadDamping &&
           std::fabs(f[HeldLoad::kStiffness]) <= kGreatestLoadStiffness &&
           std::fabs(f[HeldLoad::kLevel]) <= kGreatestLoadLevel;
  });
}
template <class A>
auto fields(Walk<A> a, HeldLoad& l) {
  return a(l.any, within("a load that comes within s", l.left, 0.0, kLongestLoad))
      .when(l.any,
            [&](auto b) {
              const std::size_t knots = a.archive.at.knots();
              return b(rule(l.now).first(knots), rule(l.told).first(knots), rule(l.own).first(knots));
            })
      .require(!A::checks || !l.any || (bounded(l.now) && bounded(l.told)), "a load beyond what is allowed");
}

template <class A>
auto fields(Walk<A> a, interaction::HeatColumn& c) {
  return a(c.excess, c.arrhenius, c.dried, c.charred, c.crushed, c.denatured, c.surface);
}
template <class A>
auto fields(Walk<A> a, interaction::HeatLedger& l) {
  return a(l.delivered, l.perfused, l.surface, l.latent, derived(l.stored));
}
template <class A>
auto fields(Walk<A> a, interaction::HeatState& h) {
  return a(h.touched).when(h.touched, [&](auto b) {
    return b(h.warm, h.stiffened, h.denaturing, rule(h.columns).first(a.archive.at.knots()),
             rule(h.sealed).sized(a.archive.at.start().heat.sealed.size()), h.ledger);
  });
}

template <class A>
auto fields(Walk<A> a, interaction::CutCrossing& x) {
  return a(index("contact triangle", x.triangle, a.archive.at.triangles()), index("edge", x.edge, 3), x.place,
           index("corner", x.knot, 4));
}
template <class A>
auto fields(Walk<A> a, interaction::CutTrack& x) {
  const auto& at = a.archive.at;
  return a(index("contact triangle", x.triangle, at.triangles()), index("knot", x.knots, at.knots()), x.from,
           x.to, x.settled);
}
template <class A>
auto fields(Walk<A> a, interaction::CutFace& f) {
  const std::size_t n = a.archive.at.skinTriangles();
  return a(index("skin triangle", f.skin_triangle, n), index("edge", f.edge, 4),
           index("skin triangle", f.built, n).orNone());
}
template <class A>
auto fields(Walk<A> a, interaction::CutState& c) {
  const auto& at = a.archive.at;
  const auto& before = at.start().cut;
  const std::size_t skin = c.rest.size(), triangles = at.triangles();
  return a(c.crossings, c.tracks, c.exhausted, derived(c.spare))
      .when(at.changed,
            [&](auto b) {
              return b(c.line, c.inward, index("contact triangle", c.home, triangles).orNone(), c.open,
                       index("contact triangle", c.lies_on, triangles), c.rest, c.free,
                       index("vertex", c.outer, c.rest.size()).orNone(),
                       index("vertex", c.inner, c.rest.size()).orNone(),
                       index("vertex", c.wall, c.rest.size()).orNone(), c.faces, c.parts, c.area, c.energy,
                       c.opened, c.unfinished);
            })
      .require(c.line.empty() == before.line.empty() && (skin > 0 || before.rest.empty()),
               "a cut of an object that cannot be cut")
      .require(
          c.line.empty() || (c.line.size() == triangles && c.inward.size() == at.now().block.knotCapacity() &&
                             (skin == 0 || (c.home.size() == at.skinTriangles() &&
                                            c.open.size() == c.home.size() && skin == at.vertices())) &&
                             c.lies_on.size() == skin && c.free.size() == skin && c.outer.size() == skin &&
                             c.inner.size() == skin && c.wall.size() == skin),
          "lists of a cut that do not fit each other");
}

template <class A>
auto fields(Walk<A> a, motility::MotilityState& m) {
  return a(within("a phase of motility", m.phase, -1e9, 1e9));
}

inline bool possibleSteps(const ObjectState& s, const Numbers& at) {
  if (!at.constants().deforms) return s.batches == at.start().batches && s.sub_steps == at.start().sub_steps;
  int doubled = at.constants().batches;
  while (doubled < s.batches && doubled <= kMostSubSteps) doubled *= 2;
  return s.batches == doubled && s.sub_steps >= 1 &&
         s.sub_steps <= std::max(kMostSubSteps, at.start().sub_steps) && s.sub_steps % s.batches == 0;
}
inline bool fitsScene(const ObjectState& s, const Numbers& at) {
  const ObjectState& start = at.start();
  return s.places.size() == s.topology.links.size() && s.triangle_alive.size() == s.triangles.size() &&
         s.fixed.size() == at.knots() && at.knots() >= start.block.knots() &&
         s.links.size() >= start.links.size() && (s.tissue.x.empty() || s.tissue.x.size() == at.knots()) &&
         s.tissue.x.empty() == start.tissue.x.empty() &&
         (at.constants().fem || s.triangles.size() == start.triangles.size());
}

inline bool hasChanged(const ObjectState& s) {
  return s.topology.revision != 0 || !s.cut.tracks.empty() || s.dropped;
}

/// Motion, which every step changes before it is known to be good; then shape, which it may change only by
/// what its input asks for (keepShape()) until then.
template <class A>
auto fields(Walk<A> a, ObjectState& s) {
  auto& at = a.archive.at;
  at.changed = hasChanged(s);
  if (a.archive.shapes) a.archive.values(&at.changed, 1, Limits{});  // else it is as the scene says
  // What does not deform stays where it is: a step's backup leaves it out.
  const auto all =
      a.when(a.archive.shapes || at.constants().deforms, [&](auto b) { return b(s.block); })(
           s.sub_steps, s.batches, within("a strain", s.limit_strain, 0.0, 1e9), s.bound_strain,
           within("a parameter", s.elastic_scale, 0.0, 1e9), within("a parameter", s.damping_scale, 0.0, 1e9),
           s.degraded, s.dropped, s.load, s.motility, s.way, s.way_bounded, s.way_searched, s.tissue)
          .shape([&](auto b) {
            return b(s.links, derived(s.law_links), derived(s.linear_links), s.heat, s.cut)
                .when(at.changed, [&](auto d) {
                  return d(s.elements, s.topology, s.places, index("knot", s.triangles, at.knots()),
                           s.triangle_alive, s.fixed, rule(s.depth).sized(s.block.knotCapacity()))
                      .when(!s.tissue.x.empty(), [&](auto e) { return e(s.fem_surface); });
                });
          });
  // Checker looks at what it finds changed: nothing else may have been read.
  if (A::reads && a.archive.shapes && at.changed != hasChanged(s))
    refuse("an object whose topology is not as new as it says");
  return all.require(!A::checks || possibleSteps(s, at), "sub-steps or exchanges that no object takes")
      .require(!A::checks || fitsScene(s, at), "an object that is not the scene's");
}

template <class A>
auto fields(Walk<A> a, net::Anchor& x) {
  const auto& at = a.archive.at;
  return a(index("object", x.object, at.objects()))(index("knot of an anchor", x.knots, at.knotsOf(x.object)),
                                                    x.weights, x.height);
}
template <class A>
auto fields(Walk<A> a, ConnectionState& c) {
  return a(c.end0, c.end1, c.alive, c.force);
}
template <class A>
auto fields(Walk<A> a, interaction::ToolPose& p) {
  return a(place("a tool's place", p.tip), p.orientation, place("a tool's place", p.pivot),
           within("a jaw's angle", p.jaw, -10.0, 10.0))
      .require(std::fabs(p.orientation.squaredNorm() - 1.0) < 0.2,
               "a tool's orientation that is no rotation");
}
template <class A>
auto fields(Walk<A> a, interaction::Proxy& p) {
  return a(p.present, index("kind of tool", p.tool, tools::kToolKindCount), p.pose,
           speed("a tool's velocity", p.velocity), place("a tool's place", p.commanded), p.force, p.torque,
           p.tip_force, p.jaw_torque, p.jaw_stiffness);
}
template <class A>
auto fields(Walk<A> a, interaction::GraspAnchor& g) {
  const auto& at = a.archive.at;
  return a(index("object", g.object, at.objects()))(index("knot of a grasp", g.knot, at.knotsOf(g.object)),
                                                    g.local, g.stiffness, g.damping)
      .require(at.deforms(g.object), "a grasp of a rigid object");
}
template <class A>
auto fields(Walk<A> a, interaction::Grasp& g) {
  const auto& at = a.archive.at;
  return a(g.active, g.sliding, g.jaw_at_touch, g.pinch,
           within("knots of a grasp", g.count, 0, interaction::kMaxGraspAnchors))(
             rule(g.anchors).first(static_cast<std::size_t>(g.count)))(
             g.id,
             index("contact triangle", g.element,
                   g.count > 0 ? at.trianglesOf(g.anchors[0].object, true) : kAny),
             g.barycentric)
      .require(!g.active || g.count > 0, "a grasp that holds nothing");
}
template <class A>
auto fields(Walk<A> a, interaction::CuttingTool& t) {
  const auto& at = a.archive.at;
  return a(t.owed, t.force, t.torque, t.place, index("object", t.object, at.objects()))(
      index("contact triangle", t.element, at.trianglesOf(t.object, t.owed > 0.0)));
}
template <class A>
auto fields(Walk<A> a, interaction::CuttingState& c) {
  return a(c.tools);
}
template <class A>
auto fields(Walk<A> a, interaction::Electrode& e) {
  const auto& at = a.archive.at;
  return a(e.on, index("object", e.object, at.objects()))(
             index("contact triangle", e.element, at.trianglesOf(e.object, false)), e.weights, e.energy,
             e.since)
      .require(!(e.energy > 0.0) || e.element < at.trianglesOf(e.object, true),
               "heat of an electrode on an object that has no surface");
}
template <class A>
auto fields(Walk<A> a, interaction::Electrosurgery& e) {
  return a(e.monopolar_power, e.bipolar_power, e.electrodes);
}

template <class A>
auto fields(Walk<A> a, interaction::Clip& c) {
  const auto& at = a.archive.at;
  return a(c.id, c.alive, c.shut, c.joined,
           within("instrument", c.instrument, -1, tools::kInstrumentCount - 1),
           index("object", c.object, at.objects()),
           within("knots of a clip", c.count, 0, interaction::kMaxClipKnots))(
             within("knots of a clip's ring", c.ring, 0, c.count),
             index("knot of a clip", c.knots, c.alive ? at.knotsOf(c.object) : kAny)
                 .first(static_cast<std::size_t>(c.count)),
             place("a clip's knot", c.open).first(static_cast<std::size_t>(c.count)),
             place("a clip's knot", c.closed).first(static_cast<std::size_t>(c.count)), c.progress, c.jaw,
             orNan(c.station), orNan(c.area), c.force, c.rotation, place("a clip's place", c.centre),
             c.offset, place("a clip's joint", c.joint))
      .require(!c.alive || at.deforms(c.object), "a clip on a rigid object");
}
template <class A>
auto fields(Walk<A> a, interaction::SlingTouch& t) {
  const auto& at = a.archive.at;
  return a(t.on, t.side, t.object)(
      index("knot of a sling", t.knots, t.on || t.side != 0 ? at.knotsOf(t.object) : kAny), t.weights,
      t.offset);
}
template <class A>
auto fields(Walk<A> a, interaction::Sling& s) {
  const auto& at = a.archive.at;
  return a(s.id, s.alive, s.around, s.tied, s.drawing, s.instrument, index("object", s.object, at.objects()),
           within("knots of a sling", s.count, 0, interaction::kMaxSlingKnots))(
             index("knot of a sling", s.knots, s.alive ? at.knotsOf(s.object) : kAny)
                 .first(static_cast<std::size_t>(s.count)),
             within("ring of a sling", s.ring, -1,
                    s.object < at.objects()
                        ? static_cast<double>(at.model->description.objects[s.object].tube.rings.size()) - 1.0
                        : -1.0),
             within("a sling's length", s.rest, 0.0, 10.0), s.tension, orNan(s.station), orNan(s.area),
             place("a sling's place", s.node), speed("a sling's velocity", s.velocity), s.touch,
             place("a sling's place", s.tip), s.ahead, s.across)
      .require(s.instrument >= (s.alive ? 0 : -1) && s.instrument < tools::kInstrumentCount,
               "a sling without instrument")
      .require(!s.alive || !s.around || at.deforms(s.object), "a sling around a rigid object");
}
template <class A>
auto fields(Walk<A> a, interaction::Applier& p) {
  return a(p.jaw_at_touch, p.loaded, p.drawn);
}
template <class A>
auto fields(Walk<A> a, interaction::Fasteners& f) {
  return a(f.clips, f.slings, f.appliers)
      .require(f.clips.size() <= interaction::kMaxClips && f.slings.size() <= interaction::kMaxSlings,
               "too many clips or slings");
}

template <class A>
auto fields(Walk<A> a, interaction::HungKnot& h) {
  const auto& at = a.archive.at;
  return a(index("object", h.object, at.objects()))(index("knot that hangs", h.knot, at.knotsOf(h.object)),
                                                    place("a place to hang at", h.place), h.stiffness,
                                                    h.damping)
      .require(at.deforms(h.object), "a rigid object that hangs");
}
template <class A>
auto fields(Walk<A> a, interaction::Suspension& s) {
  return a(s.id, s.alive, within("instrument", s.instrument, -1, tools::kInstrumentCount - 1),
           within("knots that hang", s.count, 0, interaction::kMaxGraspAnchors))(
             rule(s.knots).first(static_cast<std::size_t>(s.count)))(s.force)
      .require(s.alive == (s.count > 0), "a suspension that holds nothing");
}
template <class A>
auto fields(Walk<A> a, interaction::Suspensions& s) {
  return a(s.all, s.pressed);
}

template <class A>
auto fields(Walk<A> a, suture::LiveContact& c) {
  const std::size_t nodes = a.archive.at.threadNodes();
  return a(index("segment of a thread", c.a, nodes), index("segment of a thread", c.b, nodes), c.normal,
           c.force);
}
template <class A>
auto fields(Walk<A> a, suture::State& s) {
  const auto& at = a.archive.at;
  const std::size_t nodes = at.threadNodes(), joints = at.threadJoints();
  return a(s.time, place("a thread's place", s.position).sized(nodes),
           speed("a thread's velocity", s.velocity).sized(nodes), rule(s.frame).sized(nodes),
           rule(s.spin).sized(nodes), rule(s.natural_curvature).sized(joints), rule(s.offset).sized(joints),
           rule(s.severed).sized(nodes),
           within("contacts of threads", s.contact_count, 0.0, static_cast<double>(at.threadContacts())))(
      rule(s.contacts).first(s.contact_count));
}
template <class A>
auto fields(Walk<A> a, interaction::ThreadTouch& t) {
  const auto& at = a.archive.at;
  const bool tool = t.kind == interaction::TouchKind::Tool || t.kind == interaction::TouchKind::JawFace;
  return a(index("place of a thread", t.segment, at.threadPlaces()), index("a kind of touch", t.kind, 4))(
      index("what a thread touches", t.body,
            tool ? static_cast<std::size_t>(tools::kInstrumentCount) : at.objects()),
      t.part, t.side, t.shear, t.normal);
}
template <class A>
auto fields(Walk<A> a, interaction::GripNode& g) {
  return a(index("node of a thread", g.node, a.archive.at.threadNodes()), g.local);
}
template <class A>
auto fields(Walk<A> a, interaction::ThreadGrip& g) {
  return a(g.active, g.sliding, g.jaw_at_touch, g.pinch,
           within("nodes in jaws", g.count, 0, interaction::kMaxGripNodes))(
      rule(g.nodes).first(static_cast<std::size_t>(g.count)));
}
template <class A>
auto fields(Walk<A> a, interaction::NeedleGrip& g) {
  const std::size_t needles = a.archive.at.needles();
  return a(g.active, g.sliding, g.jaw_at_touch, g.pinch, index("needle", g.needle, g.active ? needles : kAny),
           within("a station on a needle", g.station, 0.0, 1.0), g.local, g.turn);
}
template <class A>
auto fields(Walk<A> a, interaction::ChannelAnchor& c) {
  const auto& at = a.archive.at;
  return a(index("contact triangle of a channel", c.triangle, at.trianglesOf(at.channel_object, true)),
           c.weight, within("a station in a channel", c.station, -kFarthest, kFarthest), c.along, c.filled);
}
template <class A>
auto fields(Walk<A> a, interaction::Channel& c) {
  auto& at = a.archive.at;
  auto head = a(index("object with a channel", c.object, at.objects()),
                index("needle of a channel", c.needle, at.needles()), c.filled, c.through, c.ahead,
                within("places of a channel", c.count, 1, interaction::kMaxChannelAnchors));
  at.channel_object = c.object;
  return head(rule(c.anchors).first(static_cast<std::size_t>(c.count)))
      .require(at.deforms(c.object), "a channel in a rigid object");
}
template <class A>
auto fields(Walk<A> a, suture::KnotKind& k) {
  return a(within("a knot's determinant", k.determinant, 0, 1000000),
           within("a knot's signature", k.signature, -1000, 1000));
}
template <class A>
auto fields(Walk<A> a, interaction::KnotWatch& k) {
  return a(k.kind, k.seen, k.drawn);
}
template <class A>
auto fields(Walk<A> a, interaction::ThreadPusher& p) {
  const auto& at = a.archive.at;
  return a(p.active, index("a thread", p.strand, at.model->start.threads.knots.size()),
           index("node of a thread", p.inside, at.threadNodes()),
           within("a drawn length", p.drawn, 0.0, kFarthest));
}
template <class A>
auto fields(Walk<A> a, interaction::ThreadState& s) {
  const std::size_t threads = a.archive.at.model->start.threads.knots.size();
  return a(s.rod, s.touches, s.grips, rule(s.knots).sized(threads))
      .when(!a.archive.at.model->threads.loops.empty(),
            [&](auto b) {
              return b(s.pushers,
                       index("node of a thread", s.packed, a.archive.at.threadNodes() + 1).sized(threads));
            })
      .require(s.touches.size() <= a.archive.at.model->threads.room(), "too many touches of threads")
      .when(a.archive.at.needles() > 0, [&](auto b) {
        return b(s.needle_grips, s.channels)
            .require(s.channels.size() <= interaction::kMaxChannels, "too many channels");
      });
}

template <class A>
auto fields(Walk<A> a, OrganPair& p) {
  const auto& at = a.archive.at;
  return a(index("object", p.object, at.objects()), index("object", p.other, at.objects()), p.edges)(
             within("side of a contact", p.side, -1, 1),
             index("knot or edge", p.knot, p.edges ? at.edgesOf(p.object) : at.knotsOf(p.object)),
             index("contact triangle or edge", p.triangle,
                   p.edges                  ? at.edgesOf(p.other)
                   : p.other < at.objects() ? at.world->objects[p.other].triangles.size()
                                            : 0),
             p.clear)
      .require(at.deforms(p.object) && at.deforms(p.other), "a rigid object among those that may touch");
}
template <class A>
auto fields(Walk<A> a, ContactSide& p) {
  const auto& at = a.archive.at;
  return a(index("object", p.object, at.objects()))(
      index("contact triangle", p.triangle, at.trianglesOf(p.object, false)),
      index("instrument", p.tool, static_cast<std::size_t>(tools::kInstrumentCount)),
      index("capsule", p.capsule, static_cast<std::size_t>(interaction::kMaxToolCapsules)), p.side);
}
template <class A>
auto fields(Walk<A> a, Energy& e) {
  return a(e.work, e.dissipated, derived(e.kinetic), derived(e.elastic), derived(e.potential));
}

template <class A>
auto fields(Walk<A> a, voxel::ToolState& t) {
  return a(index("a kind of tool in an image", t.kind, 3), index("a region", t.region, voxel::kMostRegions),
           index("a region", t.pending, voxel::kMostRegions), t.touching, t.outside, place("a tip", t.tip),
           place("a tip", t.crossed), place("a tip in an image", t.spring), t.normal,
           place("a way aside", t.aside), speed("a tip's velocity", t.velocity),
           place("a shaft's way", t.shaft), within("a stiffness", t.stiffness, 0.0, 1e9),
           within("a channel's length", t.ahead, 0.0, kFarthest),
           within("a capsule's force", t.held, 0.0, 1e9), within("a capsule's drop", t.drop, 0.0, 1e12));
}
template <class A>
auto fields(Walk<A> a, WorldState& s) {
  a.archive.at.world = &s;
  const auto objects = [&](auto b) {
    for (b.archive.at.object = 0; b.archive.at.object < s.objects.size(); ++b.archive.at.object)
      visit(b.archive, Rule<ObjectState>(s.objects[b.archive.at.object]));
  };
  std::size_t count = s.objects.size();
  a.archive.count(count, 1, Limits{});
  if (count != s.objects.size())
    refuse(std::to_string(count) + " objects (the scene has " + std::to_string(s.objects.size()) + ")");
  objects(a);
  return a(derived(s.objects), s.step, s.time, within("gravity", s.gravity, -1e4, 1e4), s.revision,
           s.next_attachment, fixedLength(s.connections), s.proxies, s.grasps, s.cutting,
           fixedLength(s.jaws_pass), fixedLength(s.blades_pass), s.pairs, s.way, s.way_revision,
           s.supported_revision, s.sides, s.electrosurgery, s.fasteners, s.suspensions, s.energy)
      .when(a.archive.at.model->threads.rods != nullptr, [&](auto b) { return b(s.threads); })
      .when(a.archive.at.model->description.feel != nullptr, [&](auto b) { return b(s.in_image); });
}

}  // namespace vest::scene
