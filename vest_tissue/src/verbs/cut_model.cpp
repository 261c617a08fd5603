#include <limits>
#include <map>
#include <set>

#include "../scene/room.h"
#include "cut_job.h"
#include "triangle_tree.h"

namespace vest::scene {
namespace {

using Eigen::Vector3d;
using interaction::CutConstants;
using interaction::CutScratch;
using interaction::CutState;
using interaction::kNone;

constexpr double kThinWall = 0.001;  ///< m: of an open surface whose scene names no wall_thickness (assumed)
constexpr double kHollow = 0.7;  ///< of the solid's depth: a wall thinner than that leaves a lumen (assumed)

using Triangles = std::vector<std::array<std::uint32_t, 3>>;

/// The contact triangle across the organ: along the inward normal, the first that looks the other way.
std::uint32_t oppositeOf(const std::vector<Vector3d>& x, const Triangles& triangles, const TriangleTree& tree,
                         std::size_t own) {
  const auto& t = triangles[own];
  const Vector3d centre = (x[t[0]] + x[t[1]] + x[t[2]]) / 3.0;
  const Vector3d n = -(x[t[1]] - x[t[0]]).cross(x[t[2]] - x[t[0]]);
  const std::uint32_t found = tree.firstBehind(centre, n, static_cast<std::uint32_t>(own));
  return found == TriangleTree::kNoTriangle ? kNone : found;
}

void measureWall(const Object& o, const std::vector<Vector3d>& x, const Triangles& triangles,
                 CutConstants& c) {
  double six = 0.0, area = 0.0;
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
  for (const auto& t : triangles) {
    six += (x[t[0]] - x[triangles[0][0]])
               .dot((x[t[1]] - x[triangles[0][0]]).cross(x[t[2]] - x[triangles[0][0]]));
    area += 0.5 * (x[t[1]] - x[t[0]]).cross(x[t[2]] - x[t[0]]).norm();
    for (std::size_t e = 0; e < 3; ++e) ++edges[{t[e], t[(e + 1) % 3]}];
  }
  const bool closed = std::all_of(edges.begin(), edges.end(), [&](const auto& e) {
    return e.second == 1 && edges.count({e.first.second, e.first.first}) == 1;
  });
  // Volume per surface: of a solid round bar half the radius, of a sheet half the thickness, so that length
  // of the cut in the surface times this is its area.
  const double solid = closed && area > 0.0 ? std::fabs(six / 6.0) / area : kThinWall;
  c.wall = o.wall_thickness > 0.0 ? (closed ? std::min(o.wall_thickness, solid) : o.wall_thickness) : solid;
  c.hollow = o.wall_thickness > 0.0 && (!closed || o.wall_thickness < kHollow * 2.0 * solid);
}

}  // namespace

void buildCut(const Object& o, ObjectState& s, CutConstants& c) {
  c.toughness = o.cut_toughness;
  c.possible = o.model == ObjectModel::Net;
  if (!c.possible) return;
  const std::vector<Vector3d>& x = o.rest_position.empty() ? o.position : o.rest_position;
  const std::size_t knots = o.position.size(), triangles = s.triangles.size();
  CutState& cut = s.cut;
  cut.line.assign(triangles, 0);
  cut.inward.assign(s.block.knotCapacity(), interaction::Vector3Floats{});
  if (triangles > 0) measureWall(o, x, s.triangles, c);
  c.opposite.resize(triangles);
  const TriangleTree tree(x, s.triangles);
  for (std::size_t t = 0; t < triangles; ++t) c.opposite[t] = oppositeOf(x, s.triangles, tree, t);

  std::vector<std::uint32_t> part(knots);
  for (std::uint32_t i = 0; i < knots; ++i) part[i] = i;
  const auto root = [&](std::uint32_t i) {
    while (part[i] != i) i = part[i] = part[part[i]];
    return i;
  };
  const auto join = [&](std::uint32_t a, std::uint32_t b) {
    const std::uint32_t ra = root(a), rb = root(b);
    part[std::max(ra, rb)] = std::min(ra, rb);
  };
  for (const auto& t : s.triangles) join(t[0], t[1]), join(t[0], t[2]);
  for (const Link& l : o.links) {
    join(l.knot0, l.knot1);
    if (l.kind == LinkKind::Bending) join(l.knot0, l.knot2);
  }
  cut.parts = 0;
  for (std::uint32_t i = 0; i < knots; ++i) cut.parts += root(i) == i;

  const Skin& skin = o.skin;
  if (skin.binding_start.size() < 2 || triangles == 0) return;
  const std::size_t vertices = skin.binding_start.size() - 1;
  c.most_vertices = 2 * vertices + 2048, c.most_triangles = 3 * skin.triangles.size() + 4096;
  if (s.topology.skin.texture_coordinates.size() != vertices)
    s.topology.skin.texture_coordinates.resize(vertices, std::array<float, 2>{});
  if (s.topology.skin.layer.size() != skin.triangles.size())
    s.topology.skin.layer.resize(skin.triangles.size(), 0);
  for (std::size_t v = 0; v < vertices; ++v) {
    Vector3d at = Vector3d::Zero();
    for (std::uint32_t e = skin.binding_start[v]; e < skin.binding_start[v + 1]; ++e)
      at += static_cast<double>(skin.binding_weights[e]) * x[skin.binding_knots[e]];
    cut.rest.push_back({static_cast<float>(at.x()), static_cast<float>(at.y()), static_cast<float>(at.z())});
  }
  cut.free.assign(vertices, 0);
  cut.lies_on.assign(vertices, 0);
  for (auto* of : {&cut.outer, &cut.inner, &cut.wall}) of->assign(vertices, kNone);
  std::set<std::pair<std::uint32_t, std::uint32_t>> directed;
  for (const auto& t : skin.triangles)
    for (std::size_t e = 0; e < 3; ++e) directed.insert({t[e], t[(e + 1) % 3]});
  double length = 0.0;
  for (const auto& t : skin.triangles) {
    std::array<Vector3d, 3> p;
    for (std::size_t e = 0; e < 3; ++e)
      p[e] = Vector3d(cut.rest[t[e]][0], cut.rest[t[e]][1], cut.rest[t[e]][2]);
    const Vector3d normal = (p[1] - p[0]).cross(p[2] - p[0]);
    // The contact triangle that a piece of skin lies on.
    const std::uint32_t home = tree.nearest((p[0] + p[1] + p[2]) / 3.0, normal);
    cut.home.push_back(home);
    std::uint8_t open = 0;
    for (std::size_t e = 0; e < 3; ++e) {
      length += (p[(e + 1) % 3] - p[e]).norm();
      cut.lies_on[t[e]] = home;
      if (directed.count({t[(e + 1) % 3], t[e]}) == 0) open |= static_cast<std::uint8_t>(1u << e);
    }
    cut.open.push_back(open);
  }
  c.skin_edge = skin.triangles.empty() ? 0.0 : length / (3.0 * static_cast<double>(skin.triangles.size()));
}

void reserveCut(const WorldModel& model, WorldState& state) {
  for (std::size_t i = 0; i < state.objects.size(); ++i) {
    const CutConstants& c = model.objects[i].cut;
    if (!c.possible) continue;
    ObjectState& s = state.objects[i];
    CutState& cut = s.cut;
    giveRoom(cut.crossings, 3 * s.triangles.size());
    giveRoom(cut.tracks, 2 * s.triangles.size());
    giveRoom(cut.faces, c.most_triangles / 2);
    giveRoom(cut.home, c.most_triangles), giveRoom(cut.open, c.most_triangles);
    giveRoom(cut.lies_on, c.most_vertices), giveRoom(cut.rest, c.most_vertices),
        giveRoom(cut.free, c.most_vertices);
    for (auto* of : {&cut.outer, &cut.inner, &cut.wall}) giveRoom(*of, c.most_vertices);
    auto& volumes = s.elements.volumes;
    if (!volumes.empty()) {
      const std::size_t most = std::max(volumes.size(), interaction::kMostCutVolumes);
      giveRoom(volumes, most), giveRoom(cut.spare, most);
      cut.spare.resize(most - volumes.size());
      for (auto* of : {&volumes, &cut.spare}) {
        for (net::Volume& v : *of) {
          giveRoom(v.triangles, 2 * s.triangles.size() + 64), giveRoom(v.knots, s.block.knotCapacity());
        }
      }
    }
    Skin& skin = s.topology.skin;
    const std::size_t entries =
        model.start.objects[i].topology.skin.binding_knots.size() + 16 * (c.most_vertices + 1);
    giveRoom(skin.binding_start, c.most_vertices + 2);
    giveRoom(skin.binding_knots, entries), giveRoom(skin.binding_weights, entries);
    giveRoom(skin.texture_coordinates, c.most_vertices);
    giveRoom(skin.triangles, c.most_triangles), giveRoom(skin.layer, c.most_triangles);
    giveRoom(s.topology.triangle_alive, c.most_triangles);
  }
}

void reserveCut(const WorldModel& model, CutScratch& k) {
  std::size_t knots = 0, triangles = 0, vertices = 0, faces = 0, entries = 0;
  for (std::size_t i = 0; i < model.objects.size(); ++i) {
    const CutConstants& c = model.objects[i].cut;
    if (!c.possible) continue;
    const ObjectState& s = model.start.objects[i];
    knots = std::max(knots, s.block.knotCapacity());
    triangles = std::max(triangles, s.triangles.size());
    vertices = std::max(vertices, c.most_vertices);
    faces = std::max(faces, c.most_triangles);
    entries = std::max(entries, s.topology.skin.binding_knots.size() + 16 * (c.most_vertices + 1));
  }
  for (auto* start : {&k.incident_start, &k.before_start}) start->resize(knots + 3);
  for (auto* list : {&k.incident, &k.before}) list->resize(3 * triangles + 1);
  k.work.reserve(3 * triangles + 1);
  for (auto* of : {&k.version_of, &k.split, &k.part, &k.uncut}) of->resize(knots + 1);
  k.near_knot.resize(knots + 1), k.hops.resize(knots + 1);
  k.near_triangle.resize(triangles + 1);
  k.triangles_before.reserve(triangles + 1);
  k.reached.reserve(knots + 1), k.rim.reserve(3 * triangles + 1);
  k.vertex_start.resize(vertices + 3);
  k.vertex_triangles.resize(3 * faces + 1);
  k.skin_now.reserve(faces + 1);
  k.moved.resize(faces + 1), k.walled.resize(faces + 1);
  k.border.resize(vertices + 1), k.candidate.resize(vertices + 1);
  k.order.reserve(vertices + 1);
  k.new_start.resize(vertices + 1), k.new_count.resize(vertices + 1);
  k.new_knots.reserve(65536), k.new_weights.reserve(65536);
  k.binding_start.reserve(vertices + 2), k.binding_knots.reserve(entries), k.binding_weights.reserve(entries);
}

}  // namespace vest::scene
