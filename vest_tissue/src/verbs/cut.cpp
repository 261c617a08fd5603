#include <algorithm>
#include <cmath>
#include <limits>

#include "../scene/connections.h"
#include "cut_job.h"

namespace vest::scene {
namespace {

using Eigen::Vector3d;
using interaction::BladeSweep;
using interaction::CutCrossing;
using interaction::CuttingTool;
using interaction::CutTrack;
using interaction::kNone;
using net::Block;

constexpr double kSlack = 1e-3;  ///< of an edge: neighbours overlap by it, so that no crossing is lost
/// The cutting force of a track is spread over this way of the blade (m, assumed): tracks come in pieces.
constexpr double kSpread = 0.001;
/// The share of the toughness that a cutting current leaves to the hand; assumed: it vaporises its way.
constexpr double kElectricShare = 0.1;
constexpr double kSlowest = 1e-3;  ///< m/s: below it the cutting force fades with the speed (tuned)

interaction::MovingSegment edgeOf(const CutJob& j, std::uint32_t a, std::uint32_t b) {
  const float* const before = j.c.scratch.objects[j.object].backup.data();
  const std::ptrdiff_t y = row(j.s, Block::Y) - row(j.s, Block::X),
                       z = row(j.s, Block::Z) - row(j.s, Block::X);
  const auto was = [&](std::uint32_t k) { return Vector3d(before[k], before[k + y], before[k + z]); };
  return {{was(a), was(b)}, {knotPosition(j.s, a), knotPosition(j.s, b)}};
}

/// The first active sweep that crosses the edge a…b, told from a to b whichever way round it is asked.
const BladeSweep* crossedBy(const CutJob& j, std::uint32_t a, std::uint32_t b, double& place) {
  const auto edge = edgeOf(j, std::min(a, b), std::max(a, b));
  if (!j.k.reach.holds(edge.to[0], edge.to[1])) return nullptr;
  for (int i = 0; i < j.k.sweep_count; ++i) {
    const BladeSweep& sweep = j.k.sweeps[static_cast<std::size_t>(i)];
    if (!sweep.active || !interaction::crosses(sweep, edge, kSlack, place)) continue;
    place = std::clamp(a < b ? place : 1.0 - place, 0.0, 1.0);
    return &sweep;
  }
  return nullptr;
}

/// Finds crossed edges. Returns whether there are any new ones.
bool detect(CutJob& j, std::uint8_t& instrument) {
  bool found = false;
  for (std::uint32_t t = 0; t < j.s.triangles.size(); ++t) {
    const auto& knots = j.s.triangles[t];
    if (!j.s.triangle_alive[t]) continue;
    const Vector3d p0 = knotPosition(j.s, knots[0]), p1 = knotPosition(j.s, knots[1]),
                   p2 = knotPosition(j.s, knots[2]);
    if (!j.k.reach.holds(p0.cwiseMin(p1).cwiseMin(p2), p0.cwiseMax(p1).cwiseMax(p2))) continue;
    for (std::uint8_t e = 0; e < 3; ++e) {
      if (j.cut.line[t] >> e & 1u) continue;
      double place = 0.0;
      const BladeSweep* const sweep = crossedBy(j, knots[e], knots[(e + 1) % 3], place);
      if (sweep == nullptr) continue;
      const bool known = std::any_of(j.cut.crossings.begin(), j.cut.crossings.end(),
                                     [&](const CutCrossing& x) { return x.triangle == t && x.edge == e; });
      if (known) continue;
      if (j.cut.crossings.size() == j.cut.crossings.capacity()) {
        j.cut.exhausted = true;
        return found;
      }
      j.cut.crossings.push_back({t, e, static_cast<float>(place), 3});
      instrument = sweep->instrument;
      found = true;
    }
  }
  return found;
}

/// Marks the edge between two corners of a triangle as part of the line, on both of its sides.
void markLine(CutJob& j, std::uint32_t triangle, std::uint32_t a, std::uint32_t b) {
  const auto mark = [&](std::uint32_t t) {
    const auto& knots = j.s.triangles[t];
    for (std::size_t e = 0; e < 3; ++e) {
      const std::uint32_t p = knots[e], q = knots[(e + 1) % 3];
      if ((p == a && q == b) || (p == b && q == a)) j.cut.line[t] |= static_cast<std::uint8_t>(1u << e);
    }
  };
  mark(triangle);
  for (const std::uint32_t* t = j.begin(a); t != j.end(a); ++t) mark(*t);
}

/// Which knots stand for the two crossings of a triangle: those on one side of the track, the side that its
/// neighbours have chosen, unless the other side is clearly nearer. A line that changed sides at every
/// triangle would leave teeth that hang by a corner.
void chooseKnots(CutJob& j, CutCrossing& x, CutCrossing& y) {
  constexpr double kClear = 0.3;  // of an edge (tuned)
  // Edges 0 and 1 share corner 1, 1 and 2 corner 2, 0 and 2 corner 0.
  const std::uint8_t common = x.edge == 0 && y.edge == 2 ? 0 : y.edge;
  const auto other = [&](const CutCrossing& c) {
    return c.edge == common ? static_cast<std::uint8_t>((c.edge + 1) % 3) : c.edge;
  };
  const auto away = [&](const CutCrossing& c) { return c.edge == common ? c.place : 1.0f - c.place; };
  bool at_common = away(x) + away(y) < 1.0f;
  if (x.knot < 3) {
    at_common = x.knot == common;
  } else if (y.knot < 3) {
    at_common = y.knot == common;
  }
  const auto& knots = j.s.triangles[x.triangle];
  for (CutCrossing* c : {&x, &y}) {
    if (c->knot < 3) continue;
    const bool near = away(*c) < kClear || (away(*c) < 1.0 - kClear && at_common);
    c->knot = near ? common : other(*c);
    // The triangle beyond the edge takes the same knot.
    const std::uint32_t p = knots[c->edge], q = knots[(c->edge + 1u) % 3], chosen = knots[c->knot];
    for (CutCrossing& o : j.cut.crossings) {
      const auto& t = j.s.triangles[o.triangle];
      if (o.knot < 3 || t[o.edge] != q || t[(o.edge + 1u) % 3] != p) continue;
      o.knot = t[o.edge] == chosen ? o.edge : static_cast<std::uint8_t>((o.edge + 1) % 3);
    }
  }
}

Vector3d restOf(const interaction::Vector3Floats& p) {
  return {p[0], p[1], p[2]};
}

/// Which corner of a triangle stands for a crossing of its edge that is already in a track of it or of its
/// neighbour; 3: none. An edge has one place in the line, however often blades pass it.
std::uint8_t knownKnot(const CutJob& j, std::uint32_t triangle, std::uint8_t edge) {
  const auto& knots = j.s.triangles[triangle];
  const std::array<std::uint8_t, 2> corner{edge, static_cast<std::uint8_t>((edge + 1) % 3)};
  const Vector3d p = j.rest(knots[corner[0]]), along = j.rest(knots[corner[1]]) - p;
  const double squared = along.squaredNorm();
  for (const CutTrack& track : j.cut.tracks) {
    if (track.triangle != triangle) {
      const auto& of = j.s.triangles[track.triangle];
      const auto has = [&](std::uint32_t knot) { return std::find(of.begin(), of.end(), knot) != of.end(); };
      if (!has(knots[corner[0]]) || !has(knots[corner[1]])) continue;
    }
    for (std::size_t n = 0; n < 2; ++n) {
      const Vector3d off = restOf(n == 0 ? track.from : track.to) - p;
      if (off.cross(along).squaredNorm() > 1e-8 * squared * squared) continue;
      for (const std::uint8_t c : corner)
        if (j.k.version_of[track.knots[n]] == j.k.version_of[knots[c]]) return c;
    }
  }
  return 3;
}

/// One end of a track through a triangle: place at rest, corner that stands for it in the line.
struct TrackEnd {
  Vector3d at;
  std::uint8_t corner;
};

/// Puts a track through a triangle and its line. Returns its length at rest, m; 0: the line was there.
double addTrack(CutJob& j, std::uint32_t t, const TrackEnd& from, const TrackEnd& to) {
  const auto& knots = j.s.triangles[t];
  CutTrack track;
  track.triangle = t;
  track.knots = {knots[from.corner], knots[to.corner]};
  for (int e = 0; e < 3; ++e) {
    track.from[static_cast<std::size_t>(e)] = static_cast<float>(from.at[e]);
    track.to[static_cast<std::size_t>(e)] = static_cast<float>(to.at[e]);
  }
  const bool again = std::any_of(j.cut.tracks.begin(), j.cut.tracks.end(), [&](const CutTrack& other) {
    return other.triangle == t && j.k.version_of[other.knots[0]] + j.k.version_of[other.knots[1]] ==
                                      j.k.version_of[track.knots[0]] + j.k.version_of[track.knots[1]];
  });
  if (again) return 0.0;
  if (j.cut.tracks.size() == j.cut.tracks.capacity()) {
    j.cut.exhausted = true;
    return 0.0;
  }
  j.cut.tracks.push_back(track);
  if (track.knots[0] != track.knots[1]) markLine(j, t, track.knots[0], track.knots[1]);
  const double length = std::sqrt((to.at - from.at).squaredNorm());
  // Corners that the line does not touch know on which side of it they are.
  if (length > 1e-9) {
    for (const std::uint32_t corner : knots) {
      if (corner == track.knots[0] || corner == track.knots[1]) continue;
      const Vector3d along = (to.at - from.at) / length, off = j.rest(corner) - from.at;
      const Vector3d side = off - along * along.dot(off);
      const double far = std::sqrt(side.squaredNorm());
      if (far > 1e-9 && !(j.inward(corner).squaredNorm() > 0.0)) j.setInward(corner, side / far);
    }
  }
  for (const std::uint32_t knot : track.knots) {
    if (std::find(j.k.work.begin(), j.k.work.end(), knot) == j.k.work.end()) j.k.work.push_back(knot);
  }
  return length;
}

/// The end of a track that a triangle has already, with its corner; false: it has none.
bool trackOf(const CutJob& j, std::uint32_t t, std::array<TrackEnd, 2>& ends) {
  const auto& knots = j.s.triangles[t];
  for (const CutTrack& track : j.cut.tracks) {
    if (track.triangle != t) continue;
    for (std::size_t n = 0; n < 2; ++n) {
      ends[n] = {restOf(n == 0 ? track.from : track.to), 0};
      for (std::uint8_t c = 0; c < 3; ++c)
        if (j.k.version_of[knots[c]] == j.k.version_of[track.knots[n]]) ends[n].corner = c;
    }
    return true;
  }
  return false;
}

/// Joins a crossing to the track that its triangle has: a blade that goes on from where another way through
/// the triangle ended at a knot leaves no bridge there. Returns the length of what is new, m.
double joinTrack(CutJob& j, CutCrossing& x) {
  std::array<TrackEnd, 2> ends;
  if (!trackOf(j, x.triangle, ends)) return 0.0;
  const std::array<std::uint8_t, 2> corner{x.edge, static_cast<std::uint8_t>((x.edge + 1) % 3)};
  for (const std::uint8_t c : corner)
    for (const TrackEnd& end : ends)
      if (x.knot == 3 && end.corner == c) x.knot = c;
  if (x.knot == 3) x.knot = corner[x.place < 0.5f ? 0 : 1];
  const bool joined = ends[0].corner == x.knot || ends[1].corner == x.knot;
  const auto& knots = j.s.triangles[x.triangle];
  const double place = x.place;
  const Vector3d at = (1.0 - place) * j.rest(knots[corner[0]]) + place * j.rest(knots[corner[1]]);
  const bool second = (ends[1].at - at).squaredNorm() < (ends[0].at - at).squaredNorm();
  return joined ? 0.0 : addTrack(j, x.triangle, {at, x.knot}, ends[second ? 1 : 0]);
}

/// Triangles with two crossings are cut through: line, track, newly cut area (m²).
double cutThrough(CutJob& j, std::uint32_t& element) {
  auto& pending = j.cut.crossings;
  for (CutCrossing& x : pending)
    if (x.knot == 3) x.knot = knownKnot(j, x.triangle, x.edge);
  std::sort(pending.begin(), pending.end(), [](const CutCrossing& a, const CutCrossing& b) {
    return a.triangle != b.triangle ? a.triangle < b.triangle : a.edge < b.edge;
  });
  double length = 0.0;
  std::size_t kept = 0;
  std::array<TrackEnd, 2> ends;
  for (std::size_t i = 0; i < pending.size();) {
    const std::uint32_t t = pending[i].triangle;
    const bool two = i + 1 < pending.size() && pending[i + 1].triangle == t, tracked = trackOf(j, t, ends);
    if (!two && !tracked) {
      pending[kept++] = pending[i++];
      continue;
    }
    double added = 0.0;
    if (two && !tracked) {
      chooseKnots(j, pending[i], pending[i + 1]);
      const auto& knots = j.s.triangles[t];
      for (std::size_t n = 0; n < 2; ++n) {
        const CutCrossing& x = pending[i + n];
        const double place = x.place;
        ends[n] = {(1.0 - place) * j.rest(knots[x.edge]) + place * j.rest(knots[(x.edge + 1u) % 3]), x.knot};
      }
      added += addTrack(j, t, ends[0], ends[1]);
      i += 2;
    }
    for (; i < pending.size() && pending[i].triangle == t; ++i) added += joinTrack(j, pending[i]);
    if (added > 0.0) element = t;
    length += added;
  }
  pending.resize(kept);
  return length * j.constants.wall;
}

/// Links that no surface tells the side of (cords, inner knots) die when the blade crosses them.
bool cutCords(CutJob& j) {
  bool any = false;
  for (std::uint32_t i = 0; i < j.s.topology.links.size(); ++i) {
    const Link& l = j.s.topology.links[i];
    if (!j.s.topology.link_alive[i]) continue;
    if (j.begin(l.knot0) != j.end(l.knot0) && j.begin(l.knot1) != j.end(l.knot1)) continue;
    double place;
    if (crossedBy(j, l.knot0, l.knot1, place) == nullptr) continue;
    any = removeLink(j.c.state, j.object, i, j.delta) || any;
  }
  return any;
}

/// Connections that the blade passes between their ends come loose.
void cutConnections(Context& c) {
  for (std::size_t at = 0; at < c.state.connections.size(); ++at) {
    const ConnectionState& n = c.state.connections[at];
    if (!n.alive) continue;
    const Vector3d p = footOf(c.state, n.end0), q = footOf(c.state, n.end1);
    if (!c.scratch.cut.reach.holds(p, q)) continue;
    double place;
    for (int i = 0; i < c.scratch.cut.sweep_count && n.alive; ++i) {
      const BladeSweep& sweep = c.scratch.cut.sweeps[static_cast<std::size_t>(i)];
      if (!sweep.active || !interaction::crosses(sweep, {{p, q}, {p, q}}, 0.0, place)) continue;
      sever(c, at, 0.0, sweep.instrument);
    }
  }
}

/// The blade works off what it owes: a force against its way.
void resist(Context& c, int t) {
  CuttingTool& tool = c.state.cutting.tools[t];
  tool.force = tool.torque = 0.0;
  if (!(tool.owed > 0.0)) return;
  Vector3d way = Vector3d::Zero();
  double travel = 0.0;
  bool active = false;
  for (int i = 0; i < c.scratch.cut.sweep_count; ++i) {
    const BladeSweep& sweep = c.scratch.cut.sweeps[static_cast<std::size_t>(i)];
    if (sweep.instrument != t || !sweep.active) continue;
    active = true;
    // Where on the edge the last cut was.
    const Vector3d along = sweep.to[1] - sweep.to[0];
    const double at = std::clamp((tool.place - sweep.to[0]).dot(along) / along.squaredNorm(), 0.0, 1.0);
    const Vector3d moved = (1.0 - at) * (sweep.to[0] - sweep.from[0]) + at * (sweep.to[1] - sweep.from[1]);
    const double length = std::sqrt(moved.squaredNorm());
    if (length > travel) travel = length, way = moved / length;
  }
  if (!active || !(travel > 1e-9)) {
    if (!active) tool.owed = 0.0;  // the blade has left: what it cut gapes already
    return;
  }
  const double fade = std::min(1.0, travel / (c.dt * kSlowest));
  const double paid = fade * tool.owed * travel / (kSpread + travel);
  tool.owed -= paid;
  tool.force = paid / travel;
  auto& loads = c.scratch.objects[tool.object].loads;
  auto& load = loads.tools[t];
  loads.work += paid;
  loads.dissipated += paid;
  const auto& proxy = c.state.proxies[t];
  if (proxy.tool == tools::ToolKind::Scissors) {  // blades press against each other: only the hand feels it
    const double closing = c.scratch.proxies_before[t].pose.jaw - proxy.pose.jaw;
    if (closing > 0.0) tool.torque = paid / closing;
    return;
  }
  // A hook draws the tissue along and is held back by it.
  give(load, -tool.force * c.dt * way, tool.place);
  // No knot is driven faster than the hook moves: shreds weigh next to nothing.
  ObjectState& s = c.state.objects[tool.object];
  const double pull = tool.force * c.dt / 3.0, speed = travel / c.dt;
  for (const std::uint32_t knot : s.triangles[tool.element]) {
    const double room = std::max(0.0, speed - knotVelocity(s, knot).dot(way));
    const Vector3d gain = std::min(row(s, Block::kInverseMass)[knot] * pull, room) * way;
    c.body(tool.object).accelerate(s, knot, gain);
  }
}

/// Which objects the blades of a tool pass through in the next step.
void renewPassing(Context& c, int t) {
  CuttingTool& tool = c.state.cutting.tools[t];
  const auto& proxy = c.state.proxies[t];
  auto& pass = c.state.blades_pass;
  const auto passAll = [&](bool on) {
    for (auto& bits : pass) setBit(bits, t, on);
  };
  if (!proxy.present ||
      (proxy.tool != tools::ToolKind::Scissors && proxy.tool != tools::ToolKind::CoagulationHook)) {
    tool = CuttingTool{};
    passAll(false);
    return;
  }
  if (proxy.tool == tools::ToolKind::CoagulationHook) {
    passAll((c.input.tools[t].functions & tools::kFunctionCut) != 0);
    return;
  }
  const auto& g = tools::toolGeometry(proxy.tool);
  const double closing = c.scratch.proxies_before[t].pose.jaw - proxy.pose.jaw;
  const bool cuts = closing > interaction::kCuttingJawSpeed * c.dt;
  if (!cuts && std::none_of(pass.begin(), pass.end(), [&](auto bits) { return bits >> t & 1u; })) return;
  const Eigen::Matrix3d turn = proxy.pose.orientation.toRotationMatrix().transpose();
  const double half = 0.5 * proxy.pose.jaw;  // tan h > h below pi/2: a margin covers the difference
  for (ObjectScratch& o : c.scratch.objects) o.between = false;
  for (const std::size_t object : c.model.bodies) {
    ObjectScratch& o = c.scratch.objects[object];
    const ObjectState& s = c.state.objects[object];
    const Vector3d low = o.low.cast<double>(), high = o.high.cast<double>();
    if (((proxy.pose.tip.array() + 0.03) < low.array()).any() ||
        ((proxy.pose.tip.array() - 0.03) > high.array()).any())
      continue;
    const double edge = 0.5 * c.model.objects[object].greatest_edge;
    const auto inside = [&](const Vector3d& p) {
      const Vector3d q = turn * (p - proxy.pose.tip);
      const double along = q.z() + g.jaw_length;
      return along > -0.002 && along < g.jaw_length + 0.002 && std::fabs(q.y()) < 0.003 + edge &&
             std::fabs(q.x()) < 0.003 + 1.1 * half * std::max(along, 0.0);
    };
    for (std::size_t i = 0; i < s.triangles.size(); ++i) {
      const auto& knots = s.triangles[i];
      const Vector3d p0 = knotPosition(s, knots[0]), p1 = knotPosition(s, knots[1]),
                     p2 = knotPosition(s, knots[2]);
      if (!inside(p0) && !inside(0.5 * (p0 + p1)) && !inside((p0 + p1 + p2) / 3.0)) continue;
      o.between = true;
      break;
    }
  }
  // What was between the blades while they closed is not pushed until they open again or are gone.
  for (std::size_t object = 0; object < pass.size(); ++object) {
    const bool between = c.scratch.objects[object].between, passed = pass[object] >> t & 1u;
    setBit(pass[object], t, cuts ? passed || between : closing >= 0.0 && passed && between);
  }
}

/// Of a triangle's middle; NaN without one, or off any tube.
double middleStation(const Context& c, std::size_t object, std::uint32_t triangle) {
  if (triangle == kNone) return std::numeric_limits<double>::quiet_NaN();
  return stationOf(c.model, c.state, object, c.state.objects[object].triangles[triangle],
                   {1.0 / 3, 1.0 / 3, 1.0 / 3});
}

}  // namespace

void tellCut(Context& c, std::size_t object, double area, std::uint32_t triangle, const Vector3d& place,
             std::uint8_t instrument, bool electric) {
  CuttingTool& tool = c.state.cutting.tools[instrument];
  interaction::CutState& cut = c.state.objects[object].cut;
  const double energy = c.model.objects[object].cut.toughness * area;
  tool.owed += electric ? kElectricShare * energy : energy;
  tool.object = static_cast<std::uint16_t>(object);
  tool.element = triangle;
  tool.place = place;
  cut.area += area;
  cut.energy += energy;
  Event e = eventOf(c, EventKind::Cut, instrument, object, triangle);
  e.barycentric = {1.0 / 3, 1.0 / 3, 1.0 / 3, 0.0};
  e.position = place;
  e.station = middleStation(c, object, triangle);
  e.area = area;
  e.force = tool.owed / kSpread;
  e.energy = energy;
  emit(c, e);
}

void tellSeparated(Context& c, std::size_t object, std::uint32_t count, std::uint32_t triangle,
                   std::uint8_t instrument) {
  Event e = eventOf(c, EventKind::Separated, instrument, object, triangle == kNone ? 0 : triangle);
  e.position = c.state.cutting.tools[instrument].place;
  e.station = middleStation(c, object, triangle);
  e.area = c.state.objects[object].cut.area;
  for (; count > 0; --count) emit(c, e);
}

void NetBody::divide(Context& c, std::size_t object) const {
  if (!c.model.objects[object].cut.possible) return;
  const ObjectScratch& o = c.scratch.objects[object];
  const bool near = c.scratch.cut.near(o.low, o.high);
  if (!near && !c.state.objects[object].cut.unfinished) return;
  TopologyDelta& delta = c.deltas->next();
  beginDelta(c.state, static_cast<std::uint16_t>(object), delta);
  CutJob j(c, object, delta);
  std::uint8_t instrument = 0;
  std::uint32_t element = kNone;
  j.k.work.clear();
  const std::uint32_t parts = j.cut.parts;
  bool changed = false;
  const bool found = near && detect(j, instrument);
  if (found || near || j.cut.unfinished) {
    if (found || j.cut.unfinished || !j.s.topology.links.empty()) {
      renewVersions(j);
      renewIncident(j);
    }
    if (near) changed = cutCords(j);
  }
  if (found) {
    const double area = cutThrough(j, element);
    if (element != kNone) {
      const bool electric = std::any_of(
          j.k.sweeps.begin(), j.k.sweeps.begin() + j.k.sweep_count,
          [&](const BladeSweep& sweep) { return sweep.instrument == instrument && sweep.electric; });
      tellCut(c, object, area, element, j.middle(element), instrument, electric);
      changed = divideNet(j) || changed;
    }
  }
  if (changed || j.cut.unfinished) {
    divideElements(j);
    j.parted = j.cut.parts > parts;
    openSkin(j);
    changed = !delta.removed_links.empty() || !delta.doubled_knots.empty() ||
              !delta.removed_triangles.empty() || !delta.added_triangles.empty() ||
              !delta.rebound_vertices.empty();
  }
  if (!changed) return;
  endDelta(c.state, delta);
  c.deltas->keep();
  if (j.cut.parts > parts) tellSeparated(c, object, j.cut.parts - parts, element, instrument);
}

void cut(Context& c) {
  interaction::CutScratch& k = c.scratch.cut;
  k.sweep_count = 0;
  k.swept = {};
  bool active = false;
  for (int t = 0; t < tools::kInstrumentCount; ++t) {
    const int count =
        interaction::sweepsOf(c.scratch.proxies_before[t], c.state.proxies[t], c.input.tools[t].functions,
                              c.dt, static_cast<std::uint8_t>(t), k.sweeps.data() + k.sweep_count);
    // Scissors that stand still for a step cut what comes past them, as long as tissue is between them: they
    // do not push it until they open.
    const bool passing = c.state.proxies[t].tool == tools::ToolKind::Scissors &&
                         c.scratch.proxies_before[t].pose.jaw - c.state.proxies[t].pose.jaw >= 0.0 &&
                         std::any_of(c.state.blades_pass.begin(), c.state.blades_pass.end(),
                                     [t](auto bits) { return (bits >> t & 1u) != 0; });
    for (int i = 0; i < count; ++i) {
      BladeSweep& sweep = k.sweeps[static_cast<std::size_t>(k.sweep_count + i)];
      sweep.active = sweep.active || passing;
      if (!sweep.active) continue;
      active = true;
      for (const auto& p : {sweep.from[0], sweep.from[1], sweep.to[0], sweep.to[1]}) k.swept.add(p);
    }
    k.sweep_count += count;
  }
  k.reach = k.swept;
  k.reach.low.array() -= interaction::kSweepReach, k.reach.high.array() += interaction::kSweepReach;
  if (active) cutConnections(c);
  for (const std::size_t object : c.model.bodies)
    if (active || c.state.objects[object].cut.unfinished) c.body(object).divide(c, object);
  for (int t = 0; t < tools::kInstrumentCount; ++t) {
    resist(c, t);
    renewPassing(c, t);
  }
}

}  // namespace vest::scene
