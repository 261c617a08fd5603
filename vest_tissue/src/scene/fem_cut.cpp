#include <algorithm>
#include <cmath>
#include <limits>

#include "room.h"
#include "stages.h"
#include "vest_tissue/fem/tissue_cut.h"
#include "vest_tissue/scene/topology.h"

namespace vest::scene {
namespace {

using Eigen::Vector3d;
using fem::kNoSlot;
using interaction::BladeSweep;
using net::Block;

constexpr double kSlack = 0.03;  ///< of the line between two elements' centres: neighbours overlap by it
constexpr std::uint32_t kNone = ~0u;

/// One object's cut in one step.
struct Job {
  Context& c;
  std::uint16_t object;
  ObjectState& s;
  ObjectScratch& o;
  const fem::TissueModel& tissue;
  TopologyDelta& delta;
  double area = 0.0;  ///< m², newly opened
  std::uint32_t face = kNone;
  const BladeSweep* by = nullptr;
};

Vector3d centre(const std::vector<Vector3d>& x, const std::array<fem::Index, 4>& c) {
  return 0.25 * (x[c[0]] + x[c[1]] + x[c[2]] + x[c[3]]);
}
Vector3d faceCentre(const std::vector<Vector3d>& x, const std::array<fem::Index, 3>& k) {
  return (x[k[0]] + x[k[1]] + x[k[2]]) / 3.0;
}

bool crossed(const Job& j, const interaction::MovingSegment& segment, const BladeSweep*& by) {
  const interaction::CutScratch& k = j.c.scratch.cut;
  double place;
  if (!k.swept.holds(segment.to[0], segment.to[1])) return false;
  for (int i = 0; i < k.sweep_count; ++i) {
    const BladeSweep& sweep = k.sweeps[static_cast<std::size_t>(i)];
    if (!sweep.active || !interaction::crosses(sweep, segment, kSlack, place)) continue;
    by = &sweep;
    return true;
  }
  return false;
}

/// Faces by which an element still hangs on others.
int closedFaces(const Job& j, std::uint32_t e) {
  int count = 0;
  for (std::size_t f = 0; f < 4; ++f)
    if (j.tissue.neighbours[e][f] != kNoSlot && (j.s.tissue.open[e] >> f & 1) == 0) ++count;
  return count;
}

/// Opens the faces between elements whose centres the blade has parted. An element keeps its last hold: a
/// crumb of the mesh is no piece of tissue, and would fall through what it came from.
bool openFaces(Job& j) {
  auto& t = j.s.tissue;
  const auto& before = j.o.backup_x;
  auto& knots = j.o.cut_knots;
  auto& opened = j.o.cut_faces;
  knots.clear(), opened.clear();
  const interaction::SweepBox& reach = j.c.scratch.cut.reach;
  for (std::uint32_t e = 0; e < t.corner.size(); ++e) {
    const Vector3d p = centre(t.x, t.corner[e]);
    if ((p.array() < reach.low.array() - 0.02).any() || (p.array() > reach.high.array() + 0.02).any())
      continue;
    const Vector3d p0 = centre(before, t.corner[e]);
    for (int f = 0; f < 4; ++f) {
      const std::uint32_t other = j.tissue.neighbours[e][static_cast<std::size_t>(f)];
      if (other == kNoSlot || other < e || (t.open[e] >> f & 1) != 0) continue;
      if (closedFaces(j, e) < 2 || closedFaces(j, other) < 2) continue;
      const Vector3d q = centre(t.x, t.corner[other]);
      const BladeSweep* by = nullptr;
      if (!crossed(j, {{p0, centre(before, t.corner[other])}, {p, q}}, by)) continue;
      if (opened.size() == opened.capacity() || knots.size() + 3 > knots.capacity()) return true;
      const std::uint32_t code = fem::faceCode(e, f);
      if (!fem::openFace(j.tissue, t, code)) continue;
      opened.push_back(code);
      const auto k = fem::faceKnots(t, code);
      for (const auto n : k)
        if (std::find(knots.begin(), knots.end(), n) == knots.end()) knots.push_back(n);
      j.area += 0.5 * (t.x[k[1]] - t.x[k[0]]).cross(t.x[k[2]] - t.x[k[0]]).norm();
      j.face = code;
      j.by = by;
    }
  }
  return !opened.empty();
}

/// What was in equilibrium has no momentum that a part of it could fly off with.
void rest(ObjectState& s, const ObjectScratch& o) {
  for (std::size_t k = 0; k < s.tissue.x.size(); ++k)
    if (still(s, o, k)) s.tissue.v[k].setZero();
}

/// The block follows: copies, masses, what is held.
void copyKnots(Job& j) {
  Block& b = j.s.block;
  for (const fem::Doubling& d : j.o.doublings) {
    std::uint32_t copy;
    if (!b.addKnot(copy)) return;  // the state's room is the block's
    for (const auto r :
         {Block::X, Block::Y, Block::Z, Block::VX, Block::VY, Block::VZ, Block::kDecay, Block::kInverseMass})
      b.row(r)[copy] = b.row(r)[d.original];
    j.s.fixed.push_back(j.s.fixed[d.original]);
    j.s.depth[copy] = j.s.depth[d.original];
    j.s.load.divide(d.original, copy, 0.5f);
    interaction::copyColumn(j.s.heat, d.original, copy);
    j.s.topology.doubled_knots.push_back(d.original);
    j.delta.doubled_knots.push_back(d.original);
    j.s.fem_surface.knot_vertex.push_back(kNone);
  }
  const Body& body = j.c.body(j.object);
  body.change(j.s);
  copyMasses(j.s, body.hasInertia());
}

std::uint32_t vertexOf(Job& j, std::uint32_t knot) {
  auto& surface = j.s.fem_surface;
  if (surface.knot_vertex[knot] != kNone) return surface.knot_vertex[knot];
  Skin& skin = j.s.topology.skin;
  if (skin.binding_start.size() == skin.binding_start.capacity() ||
      skin.binding_knots.size() == skin.binding_knots.capacity())
    return kNone;
  const std::uint32_t vertex = static_cast<std::uint32_t>(skin.binding_start.size() - 1);
  const Vector3d& x = j.tissue.model->description.nodes[j.s.tissue.origin[knot]];
  const std::array<float, 2> place{static_cast<float>(x.x() + 0.5 * x.z()),
                                   static_cast<float>(x.y() + 0.5 * x.z())};
  for (Skin* s : {&skin, &j.delta.added_skin}) {
    if (s->binding_start.empty()) s->binding_start.push_back(0);
    s->binding_knots.push_back(knot);
    s->binding_weights.push_back(1.0f);
    s->binding_start.push_back(static_cast<std::uint32_t>(s->binding_knots.size()));
    s->texture_coordinates.push_back(place);
  }
  surface.knot_vertex[knot] = vertex;
  surface.vertex_element.push_back(kNone);
  return vertex;
}

/// Of a face, or of none.
void addSkinTriangle(Job& j, const std::array<std::uint32_t, 3>& v, std::uint16_t layer, std::uint32_t code) {
  Skin& skin = j.s.topology.skin;
  if (std::find(v.begin(), v.end(), kNone) != v.end() || skin.triangles.size() == skin.triangles.capacity()) {
    j.s.degraded = true;
    return;
  }
  skin.triangles.push_back(v);
  skin.layer.push_back(layer);
  j.s.topology.triangle_alive.push_back(1);
  j.s.fem_surface.skin_face.push_back(code);
  j.delta.added_triangles.push_back(v);
  j.delta.added_triangle_layer.push_back(layer);
}

void addSkinFace(Job& j, std::uint32_t code, std::uint16_t layer) {
  std::array<std::uint32_t, 3> v = fem::faceKnots(j.s.tissue, code);
  for (std::uint32_t& k : v) k = vertexOf(j, k);
  addSkinTriangle(j, v, layer, code);
}

void removeSkinTriangle(Job& j, std::uint32_t i) {
  j.s.topology.triangle_alive[i] = 0;
  j.delta.removed_triangles.push_back(i);
}

/// False: the two elements held on to one corner that is two now.
bool together(const Job& j, std::uint32_t a, std::uint32_t b) {
  const auto& t = j.s.tissue;
  if (a == b || a == kNone || b == kNone) return true;
  for (const auto p : t.corner[a])
    for (const auto q : t.corner[b])
      if (p != q && t.origin[p] == t.origin[q]) return false;
  return true;
}

/// A vertex of the skin on the way from `in` to `out`, bound to the element of `in`: where that element ends,
/// but not before the middle, so that the skin's two lips leave no gap.
std::uint32_t lipVertex(Job& j, std::uint32_t in, std::uint32_t out, std::uint32_t first_new) {
  Skin& skin = j.s.topology.skin;
  auto& surface = j.s.fem_surface;
  const std::uint32_t e = surface.vertex_element[in];
  const auto& element = j.tissue.model->elements[e];
  const auto& nodes = j.tissue.model->description.nodes;
  Vector3d far = Vector3d::Zero();
  for (std::uint32_t k = skin.binding_start[out]; k < skin.binding_start[out + 1]; ++k)
    far += static_cast<double>(skin.binding_weights[k]) * nodes[j.s.tissue.origin[skin.binding_knots[k]]];
  std::array<double, 4> w{}, there{};
  double way = 1.0;
  for (std::size_t n = 0; n < 4; ++n) {
    w[n] = static_cast<double>(skin.binding_weights[skin.binding_start[in] + n]);
    there[n] = n == 0 ? 1.0 : element.gradient[n].dot(far - nodes[element.nodes[0]]);
    if (n != 0) there[0] -= there[n];
  }
  for (std::size_t n = 0; n < 4; ++n)
    if (w[n] > 0 && there[n] < 0) way = std::min(way, w[n] / (w[n] - there[n]));
  way = std::max(way, 0.5);
  std::array<float, 4> weights{};
  for (std::size_t n = 0; n < 4; ++n) weights[n] = static_cast<float>(w[n] + way * (there[n] - w[n]));
  const auto vertices = static_cast<std::uint32_t>(surface.vertex_element.size());
  for (std::uint32_t v = first_new; v < vertices; ++v)
    if (surface.vertex_element[v] == e &&
        std::equal(weights.begin(), weights.end(), skin.binding_weights.begin() + skin.binding_start[v]))
      return v;
  if (skin.binding_start.size() == skin.binding_start.capacity() ||
      skin.binding_knots.size() + 4 > skin.binding_knots.capacity() ||
      surface.vertex_element.size() == surface.vertex_element.capacity())
    return kNone;
  std::array<float, 2> place{};
  for (std::size_t k = 0; k < 2; ++k)
    place[k] = skin.texture_coordinates[in][k] +
               static_cast<float>(way) * (skin.texture_coordinates[out][k] - skin.texture_coordinates[in][k]);
  for (Skin* s : {&skin, &j.delta.added_skin}) {
    if (s->binding_start.empty()) s->binding_start.push_back(0);
    for (std::size_t n = 0; n < 4; ++n) {
      s->binding_knots.push_back(j.s.tissue.corner[e][n]);
      s->binding_weights.push_back(weights[n]);
    }
    s->binding_start.push_back(static_cast<std::uint32_t>(s->binding_knots.size()));
    s->texture_coordinates.push_back(place);
  }
  surface.vertex_element.push_back(e);
  return vertices;
}

/// An embedded triangle whose corners the cut has parted becomes two lips, one on each side.
void tearSkin(Job& j, std::uint32_t i, std::uint32_t first_new) {
  Skin& skin = j.s.topology.skin;
  const auto v = skin.triangles[i];
  const auto& element = j.s.fem_surface.vertex_element;
  std::array<bool, 3> held{};  // a corner and its next
  for (std::size_t k = 0; k < 3; ++k) held[k] = together(j, element[v[k]], element[v[(k + 1) % 3]]);
  if (held[0] && held[1] && held[2]) return;
  const std::uint16_t layer = skin.layer[i];
  removeSkinTriangle(j, i);
  const auto add = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
    addSkinTriangle(j, {a, b, c}, layer, kNone);
  };
  const auto lip = [&](std::uint32_t in, std::uint32_t out) { return lipVertex(j, in, out, first_new); };
  const std::size_t pair = held[0] ? 0 : held[1] ? 1 : held[2] ? 2 : 3;
  for (std::size_t k = 0; k < 3; ++k) {
    const std::uint32_t a = v[k], b = v[(k + 1) % 3], c = v[(k + 2) % 3];
    if (k == pair) {
      const std::uint32_t far = lip(b, c);
      add(a, b, far);
      add(a, far, lip(a, c));
    } else if (pair == 3 || k == (pair + 2) % 3) {
      add(a, lip(a, b), lip(a, c));
    }
  }
}

/// Contact triangles and skin follow their faces; open faces become surface on both sides.
void renewSurface(Job& j) {
  auto& surface = j.s.fem_surface;
  auto& t = j.s.tissue;
  for (std::size_t i = 0; i < j.s.triangles.size(); ++i) {
    const auto before = j.s.triangles[i];
    j.s.triangles[i] = fem::faceKnots(t, surface.triangle_face[i]);
    followTriangle(j.c.state, j.object, before, j.s.triangles[i]);
  }
  Skin& skin = j.s.topology.skin;
  // Embedded vertices stay in their element; triangles of the skin tear where their elements part.
  for (std::uint32_t v = 0; v < surface.vertex_element.size(); ++v) {
    const std::uint32_t e = surface.vertex_element[v];
    if (e == kNone) continue;
    bool moved = false;
    for (std::uint32_t n = 0; n < 4; ++n) {
      std::uint32_t& knot = skin.binding_knots[skin.binding_start[v] + n];
      if (t.origin[knot] == t.origin[t.corner[e][n]] && knot != t.corner[e][n])
        knot = t.corner[e][n], moved = true;
    }
    if (!moved) continue;
    Skin& told = j.delta.rebound_skin;
    if (told.binding_start.empty()) told.binding_start.push_back(0);
    j.delta.rebound_vertices.push_back(v);
    for (std::uint32_t n = 0; n < 4; ++n) {
      told.binding_knots.push_back(skin.binding_knots[skin.binding_start[v] + n]);
      told.binding_weights.push_back(skin.binding_weights[skin.binding_start[v] + n]);
    }
    told.binding_start.push_back(static_cast<std::uint32_t>(told.binding_knots.size()));
  }
  const std::size_t triangles = skin.triangles.size();
  const auto first_new = static_cast<std::uint32_t>(surface.vertex_element.size());
  for (std::uint32_t i = 0; i < triangles; ++i) {
    if (!j.s.topology.triangle_alive[i]) continue;
    const auto v = skin.triangles[i];
    const std::uint32_t code = surface.skin_face[i];
    if (code != kNone) {  // of a face: its knots may be copies now
      const auto k = fem::faceKnots(t, code);
      const bool same = surface.knot_vertex[k[0]] == v[0] && surface.knot_vertex[k[1]] == v[1] &&
                        surface.knot_vertex[k[2]] == v[2];
      if (same) continue;
      const std::uint16_t layer = skin.layer[i];
      removeSkinTriangle(j, i);
      addSkinFace(j, code, layer);
      continue;
    }
    tearSkin(j, i, first_new);
  }
  for (const std::uint32_t code : j.o.cut_faces) {
    std::uint32_t back = kNone;
    const std::uint32_t other = j.tissue.neighbours[code / 4][code % 4];
    for (std::uint32_t g = 0; g < 4; ++g)
      if (j.tissue.neighbours[other][g] == code / 4) back = 4 * other + g;
    for (const std::uint32_t side : {code, back}) {
      if (j.s.triangles.size() == j.s.triangles.capacity()) {
        j.s.degraded = true;
        continue;
      }
      j.s.triangles.push_back(fem::faceKnots(t, side));
      j.s.triangle_alive.push_back(1);
      surface.triangle_face.push_back(side);
      addSkinFace(j, side, 2);
    }
  }
}

}  // namespace

void fillFemSurface(const fem::TissueModel& tissue, ObjectState& s) {
  FemSurface& f = s.fem_surface;
  f = FemSurface{};
  for (std::uint32_t e = 0; e < tissue.neighbours.size(); ++e)
    for (int k = 0; k < 4; ++k)
      if (tissue.neighbours[e][static_cast<std::size_t>(k)] == kNoSlot)
        f.triangle_face.push_back(fem::faceCode(e, k));
  const Skin& skin = s.topology.skin;
  f.knot_vertex.assign(s.block.knots(), kNone);
  const std::size_t vertices = skin.binding_start.empty() ? 0 : skin.binding_start.size() - 1;
  f.vertex_element.assign(vertices, kNone);
  f.skin_face.assign(skin.triangles.size(), kNone);
  bool plain = skin.triangles.size() == f.triangle_face.size();
  for (std::uint32_t v = 0; v < vertices; ++v) {
    const std::uint32_t first = skin.binding_start[v], count = skin.binding_start[v + 1] - first;
    if (count == 1) f.knot_vertex[skin.binding_knots[first]] = v;
    if (count != 1) plain = false;
    if (count != 4) continue;
    // The element whose corners the binding names, in their order.
    const auto& m = *tissue.model;
    const std::uint32_t knot = skin.binding_knots[first];
    for (std::size_t k = m.incidence_start[knot]; k < m.incidence_start[knot + 1]; ++k) {
      const std::uint32_t e = m.incidence[k] / 4;
      if (std::equal(m.elements[e].nodes.begin(), m.elements[e].nodes.end(),
                     skin.binding_knots.begin() + first))
        f.vertex_element[v] = e;
    }
  }
  if (plain) f.skin_face = f.triangle_face;
  std::vector<std::uint32_t> root(tissue.neighbours.size());
  f.parts = fem::tissueParts(tissue, s.tissue, root);
}

void ElementsBody::reserve(const ObjectConstants& k, const ObjectState& start, ObjectState& s) const {
  const std::size_t knots = s.block.knotCapacity(), faces = 2 * k.fem->neighbours.size() + 64;
  auto& t = s.tissue;
  giveRoom(t.x, knots), giveRoom(t.v, knots), giveRoom(t.mass, knots);
  t.denatured.reserve(t.corner.size());
  giveRoom(t.origin, knots), giveRoom(t.knot_element, knots);
  auto& f = s.fem_surface;
  const std::size_t triangles = start.fem_surface.triangle_face.size() + faces;
  giveRoom(s.triangles, triangles), giveRoom(s.triangle_alive, triangles),
      giveRoom(f.triangle_face, triangles);
  Skin& skin = s.topology.skin;
  // Lips: at most three triangles and four vertices of four knots for a triangle that tears.
  const std::size_t torn = start.topology.skin.triangles.size(), most = 2 * torn + faces;
  const std::size_t vertices = start.fem_surface.vertex_element.size() + knots + torn;
  const std::size_t entries = start.topology.skin.binding_knots.size() + knots + 4 * torn;
  giveRoom(skin.triangles, most), giveRoom(skin.layer, most), giveRoom(s.topology.triangle_alive, most);
  giveRoom(f.skin_face, most), giveRoom(f.knot_vertex, knots), giveRoom(f.vertex_element, vertices);
  giveRoom(skin.binding_start, vertices + 1), giveRoom(skin.texture_coordinates, vertices);
  giveRoom(skin.binding_knots, entries), giveRoom(skin.binding_weights, entries);
}

void ElementsBody::divide(Context& c, std::size_t object) const {
  ObjectState& s = c.state.objects[object];
  ObjectScratch& o = c.scratch.objects[object];
  if (!c.scratch.cut.near(o.low, o.high)) return;
  TopologyDelta& delta = c.deltas->next();
  beginDelta(c.state, static_cast<std::uint16_t>(object), delta);
  Job j{c, static_cast<std::uint16_t>(object), s, o, *c.model.objects[object].fem, delta};
  // Copies of this very step lie where their originals were.
  if (o.backup_x.size() != s.tissue.x.size() || !openFaces(j)) return;
  o.doublings.clear();
  rest(s, o);
  if (!fem::divideKnots(j.tissue, s.tissue, o.cut_knots, o.doublings)) s.degraded = true;
  copyKnots(j);
  renewSurface(j);
  for (const fem::Doubling& d : o.doublings)
    remapAnchors(c.state, j.object, {d.original, d.copy, d.normal, s.tissue.x[d.original]});
  endDelta(c.state, delta);
  c.deltas->keep();
  const auto& faces = s.fem_surface.triangle_face;
  const auto found = std::find(faces.begin(), faces.end(), j.face);
  const auto triangle = found == faces.end() ? 0u : static_cast<std::uint32_t>(found - faces.begin());
  tellCut(c, object, j.area, triangle, faceCentre(s.tissue.x, fem::faceKnots(s.tissue, j.face)),
          j.by->instrument, j.by->electric);
  const std::uint32_t parts = fem::tissueParts(j.tissue, s.tissue, o.cut_roots);
  if (parts > s.fem_surface.parts)
    tellSeparated(c, object, parts - s.fem_surface.parts, triangle, j.by->instrument);
  s.fem_surface.parts = parts;
}

}  // namespace vest::scene
