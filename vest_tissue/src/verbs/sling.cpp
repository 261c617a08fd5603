#include "vest_tissue/interaction/sling.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "../scene/sling_path.h"
#include "../scene/stages.h"
#include "vest_tissue/base/elementary.h"
#include "vest_tissue/interaction/clip.h"
#include "vest_tissue/interaction/fasteners.h"
#include "vest_tissue/interaction/sling_loop.h"

namespace vest::interaction {

void remapSling(Sling& s, const net::KnotDoubling& cut, const Eigen::Vector3d& place) {
  if (s.count == 0 || !(cut.plane_normal.dot(place - cut.plane_point) > 0.0)) return;
  std::replace(s.knots.begin(), s.knots.begin() + s.count, cut.original, cut.copy);
  for (SlingTouch& t : s.touch)
    if (t.on && t.object == s.object) std::replace(t.knots.begin(), t.knots.end(), cut.original, cut.copy);
}

}  // namespace vest::interaction

namespace vest::scene {
namespace {

using Eigen::Vector3d;
using interaction::kSlingNodes;
using interaction::kSlingRadius;
using interaction::LoopPlane;
using interaction::LoopStep;
using interaction::Sling;
using interaction::SlingTouch;
using net::Block;

using LoopNodes = std::array<Vector3d, kSlingNodes>;

constexpr double kLoopMargin = 0.0015;  ///< m: a surface this near to a node's way is looked at (tuned)
constexpr double kLies =
    kSlingRadius;  ///< m: a node nearer than this to where it would touch lies on tissue (tuned)
constexpr double kRadial =
    0.5;                       ///< cosine: the surface under a node looks away from the loop's middle (tuned)
constexpr double kKeep = 1.5;  ///< of the loop's radius: a tube further from its middle has left it (tuned)
constexpr double kLegs = 0.7;  ///< of l0: two legs that long reach no slack circle's far side, 2/pi (tuned)
constexpr int kLeastArc = 8;   ///< nodes between the two legs of a thread that lies around something (tuned)
constexpr double kTaut = 0.98;  ///< of l0: a path that long is taut (tuned)
/// Of an element's volume: drawn further it would turn inside out. Tissue is nearly incompressible, and what
/// has lost so much is shut (tuned).
constexpr double kCrushed = 0.25;
constexpr double kNoTube = std::numeric_limits<double>::quiet_NaN();

Vector3d middleOf(const LoopNodes& nodes) {
  Vector3d sum = Vector3d::Zero();
  for (const Vector3d& p : nodes) sum += p / kSlingNodes;
  return sum;
}

/// Normal of the triangle of a touch, on the side of the node; no unit.
Vector3d normalOf(const ObjectState& s, const SlingTouch& t) {
  const Vector3d a = knotPosition(s, t.knots[0]);
  Vector3d n = (knotPosition(s, t.knots[1]) - a).cross(knotPosition(s, t.knots[2]) - a);
  const double length = std::sqrt(n.squaredNorm());
  return length > 1e-14 ? Vector3d(n * (t.side < 0 ? -1.0 : 1.0) / length) : Vector3d(Vector3d::Zero());
}

double areaOf(const ObjectState& s, const Sling& sling) {
  if (sling.count == 0) return interaction::polygonArea(sling.node.data(), kSlingNodes);
  std::array<Vector3d, interaction::kMaxSlingKnots> p;
  for (int i = 0; i < sling.count; ++i) p[i] = knotPosition(s, sling.knots[i]);
  return interaction::polygonArea(p.data(), sling.count);
}

/// A knot of what it lies around.
std::uint32_t knotIn(const Sling& sling) {
  if (sling.count > 0) return sling.knots[0];
  for (const SlingTouch& t : sling.touch)
    if (t.on && t.object == sling.object) return t.knots[0];
  return 0;
}

Event ligated(const Context& c, const Sling& sling) {
  Event e = eventOf(c, EventKind::Ligated, sling.instrument, sling.object, knotIn(sling));
  e.barycentric = {1.0, 0.0, 0.0, 0.0};
  e.position = middleOf(sling.node);
  e.station = sling.station;
  e.area = sling.area;
  e.force = sling.tension;
  return e;
}

bool liesOn(const Sling& sling, int nodes = 3) {
  const auto on = [&](const SlingTouch& t) { return t.on && t.object == sling.object; };
  return std::count_if(sling.touch.begin(), sling.touch.end(), on) >= nodes;
}

/// Puts the nodes onto the ring of knots of the tube, from the one nearest to the pusher on. @param from 1:
/// the central knot stays in the pusher
void layOnRing(const ObjectState& s, Sling& sling, int from = 1) {
  Vector3d middle = Vector3d::Zero();
  for (int i = 0; i < sling.count; ++i) middle += knotPosition(s, sling.knots[i]) / sling.count;
  int first = 0;
  double nearest = std::numeric_limits<double>::max();
  for (int i = 0; i < sling.count; ++i) {
    const double d = (knotPosition(s, sling.knots[i]) - sling.tip).squaredNorm();
    if (d < nearest) nearest = d, first = i;
  }
  for (int n = from; n < kSlingNodes; ++n) {
    const double at = static_cast<double>(n) * sling.count / kSlingNodes, t = at - std::floor(at);
    const int i = first + static_cast<int>(at);
    SlingTouch& touch = sling.touch[n];
    touch.on = true;
    touch.side = 0;
    touch.object = sling.object;
    touch.knots = {sling.knots[i % sling.count], sling.knots[(i + 1) % sling.count],
                   sling.knots[(i + 1) % sling.count]};
    touch.weights = {1.0 - t, t, 0.0};
    const Vector3d place = placeOf(s, touch), out = place - middle;
    touch.offset = out * (kSlingRadius / std::max(std::sqrt(out.squaredNorm()), 1e-9));
    sling.node[n] = place + touch.offset;
    sling.velocity[n].setZero();
  }
}

/// The tube whose centre line passes through the loop: with several the one nearest to its middle; one that
/// lies in it already stays, until the loop neither has its line in it nor lies on it.
void embrace(Context& c, Sling& sling) {
  // What is drawn in bears on the ring that it closes. Another one would spring open and be snatched shut.
  if (sling.around && ringPath(c.state.objects[sling.object], sling) > sling.rest - kAround) {
    if (!liesOn(sling, kSlingNodes / 2)) layOnRing(c.state.objects[sling.object], sling);
    return;
  }
  const Vector3d middle = middleOf(sling.node);
  Vector3d normal = Vector3d::Zero();
  for (int i = 0; i < kSlingNodes; ++i)
    normal += (sling.node[i] - middle).cross(sling.node[(i + 1) % kSlingNodes] - middle);
  const double radius = sling.rest / kTurn;
  double best = sling.around ? kKeep * radius : radius;
  bool found = false;
  const std::int32_t ring_before = sling.ring;
  bool above = false;  // which side of the ring is in it
  for (const std::size_t object : c.model.bodies) {
    const net::TubeMap& tube = c.model.objects[object].tube;
    if (c.body(object).filled() || tube.ringCount() < 2) continue;
    if (sling.around && sling.object != object) continue;
    const ObjectState& s = c.state.objects[object];
    Vector3d p = centreOf(s, ringNow(c, object, 0, true));
    for (std::size_t r = 0; r + 1 < tube.ringCount(); ++r) {
      const net::CutRings::Ring begin = ringNow(c, object, r, true), end = ringNow(c, object, r + 1, false);
      if (c.scratch.objects[object].rings.cut()) p = centreOf(s, begin);
      const Vector3d q = centreOf(s, end);
      const double a = normal.dot(p - middle), b = normal.dot(q - middle);
      if ((a <= 0.0) != (b <= 0.0) && begin.count > 0 && end.count > 0) {
        const double t = a / (a - b);
        const double off = std::sqrt((p + t * (q - p) - middle).squaredNorm());
        const std::size_t nearer = t > 0.5 ? r + 1 : r;
        const net::CutRings::Ring& ring = t > 0.5 ? end : begin;
        // It must fit through: no organ wider than the loop.
        double wide = 0.0;
        const Vector3d centre = centreOf(s, ring);
        for (const auto k : ring) wide = std::max(wide, (knotPosition(s, k) - centre).squaredNorm());
        const bool fits = ring.count >= 3 && ring.count <= interaction::kMaxSlingKnots &&
                          (sling.around || std::sqrt(wide) < radius);
        if (off < best && fits) {
          best = off;
          found = true;
          sling.object = static_cast<std::uint16_t>(object);
          sling.station = tube.station(r) + t * (tube.station(r + 1) - tube.station(r));
          sling.ring = static_cast<std::int32_t>(nearer);
          above = t <= 0.5;
        }
      }
      p = q;
    }
  }
  if (!found && sling.around) {
    // A thread does not pass through what it is drawn tight around: nodes that crumpled walls have misled lie
    // around the tube again.
    const ObjectState& s = c.state.objects[sling.object];
    Vector3d centre = Vector3d::Zero();
    for (int i = 0; i < sling.count; ++i) centre += knotPosition(s, sling.knots[i]);
    centre /= static_cast<double>(sling.count);
    const bool taut = ringPath(s, sling) > kTaut * (sling.rest - kAround) ||
                      2.0 * std::sqrt((centre - sling.tip).squaredNorm()) > kLegs * sling.rest;
    if (taut) layOnRing(c.state.objects[sling.object], sling);
    if (taut || liesOn(sling)) return;
  }
  sling.around = found;
  if (!found) {
    sling.ring = -1;
    sling.count = 0;
    return;
  }
  if (sling.ring == ring_before) return;
  const auto ring = static_cast<std::size_t>(sling.ring);
  const auto& scene = c.model.objects[sling.object].tube.knots(ring);
  const auto take = [&](const auto& knots) {
    sling.count = static_cast<std::int32_t>(knots.end() - knots.begin());
    std::copy(knots.begin(), knots.end(), sling.knots.begin());
  };
  const bool fits = scene.size() <= interaction::kMaxSlingKnots;  // one that was cut has fewer
  if (fits) take(scene), sling.area = areaOf(c.model.start.objects[sling.object], sling);
  take(ringNow(c, sling.object, ring, above));
  if (!fits) sling.area = areaOf(c.state.objects[sling.object], sling);
}

/// m: where a loop lies on the vessel that a body of elements is; NaN where it is none.
double stationUnder(const Context& c, const Sling& sling) {
  double sum = 0.0;
  int known = 0;
  for (const SlingTouch& t : sling.touch) {
    if (!t.on || t.object != sling.object) continue;
    const double at = stationOf(c.model, c.state, sling.object, t.knots, t.weights);
    if (std::isfinite(at)) sum += at, ++known;
  }
  return known > 0 ? sum / known : kNoTube;
}

/// Tissue that is no tube: it lies in the loop where the thread lies taut on it with most of its nodes, and
/// the surface under these looks outward. On what is filled the two legs to a pusher that stands off do not
/// count: the thread itself brings them together.
void enclose(Context& c, Sling& sling) {
  const Vector3d middle = middleOf(sling.node);
  if (sling.around) {
    sling.around = liesOn(sling);
    // What it is drawn in from is told by the loop that just begins to pull.
    if (sling.around) sling.station = stationUnder(c, sling);
    if (sling.around && c.body(sling.object).filled() && !(sling.tension > 0.0))
      sling.area = areaOf(c.state.objects[sling.object], sling);
    return;
  }
  for (const std::size_t object : c.model.bodies) {
    if (!c.body(object).fastens()) continue;
    int lie = 0, first = kSlingNodes, last = -1;
    double path = 0.0;
    for (int i = 0; i < kSlingNodes; ++i) {
      path += std::sqrt((sling.node[(i + 1) % kSlingNodes] - sling.node[i]).squaredNorm());
      const SlingTouch& t = sling.touch[i];
      if (!t.on || t.object != object) continue;
      const Vector3d out = sling.node[i] - middle;
      if (normalOf(c.state.objects[object], t).dot(out) <= kRadial * std::sqrt(out.squaredNorm())) continue;
      ++lie;
      first = std::min(first, i);
      last = i;
    }
    const int between = c.body(object).filled() ? std::max(last - first + 1, kLeastArc) : kSlingNodes;
    if (2 * lie < between || path < kTaut * sling.rest) continue;
    sling.around = true;
    sling.object = static_cast<std::uint16_t>(object);
    sling.count = 0;
    sling.station = stationUnder(c, sling);
    sling.area = areaOf(c.state.objects[object], sling);
    c.body(object).change(c.state.objects[object]);
    return;
  }
}

/// Triangles of objects whose boxes the loop's box meets, where its own box meets theirs.
void gatherCandidates(Context& c, const Vector3d& low, const Vector3d& high) {
  auto& out = c.scratch.loop_candidates;
  out.clear();
  for (const std::size_t object : c.model.bodies) {
    const ObjectState& s = c.state.objects[object];
    const ObjectScratch& o = c.scratch.objects[object];
    bool apart = false;
    for (int e = 0; e < 3; ++e) apart = apart || low[e] > o.high[e] || high[e] < o.low[e];
    if (apart) continue;
    for (std::uint32_t t = 0; t < s.triangles.size(); ++t) {
      if (!s.triangle_alive[t]) continue;
      const auto& k = s.triangles[t];
      bool beside = false;
      for (int axis = 0; axis < 3; ++axis) {
        const float* const x = row(s, static_cast<Block::KnotRow>(Block::X + axis));
        const float a = x[k[0]], b = x[k[1]], d = x[k[2]];
        beside = beside || std::min({a, b, d}) > high[axis] || std::max({a, b, d}) < low[axis];
      }
      if (beside) continue;
      if (out.size() == out.capacity()) {  // bounded; the rest is not felt, and said
        c.report.status = Status::Degraded;
        return;
      }
      out.emplace_back(static_cast<std::uint16_t>(object), t);
    }
  }
}

/// The nearest surface to a node: its plane, and where on it the node would lie.
void look(Context& c, Sling& sling, LoopStep& step, int i, double way) {
  SlingTouch& touch = sling.touch[i];
  LoopPlane& plane = step.planes[i];
  const Vector3d& x = step.start[i];
  const std::int8_t side_before = touch.side;
  const std::uint16_t object_before = touch.object;
  // Walls of a crushed tube lie close together: a node stays at the one that it was at.
  const Vector3d facing =
      side_before != 0 ? normalOf(c.state.objects[object_before], touch) : Vector3d(Vector3d::Zero());
  plane.active = false;
  touch.side = 0;
  double best = kSlingRadius + kLoopMargin + way;
  std::uint16_t object = 0;
  std::uint32_t triangle = 0;
  contact::Nearest at{};
  for (const auto& [o, t] : c.scratch.loop_candidates) {
    const ObjectState& s = c.state.objects[o];
    const auto& k = s.triangles[t];
    const std::array<Vector3d, 3> p{knotPosition(s, k[0]), knotPosition(s, k[1]), knotPosition(s, k[2])};
    const double edge = std::sqrt(std::max((p[1] - p[0]).squaredNorm(), (p[2] - p[0]).squaredNorm()));
    if ((p[0] - x).squaredNorm() > (best + edge) * (best + edge)) continue;
    const contact::Nearest n = contact::nearest(x, p);
    if (!(n.distance < best)) continue;
    if (side_before != 0 && o == object_before &&
        (p[1] - p[0]).cross(p[2] - p[0]).dot(facing) * side_before < 0.0)
      continue;
    best = n.distance, at = n, object = o, triangle = t;
    plane.active = true;
  }
  if (plane.active) {
    const ObjectState& s = c.state.objects[object];
    touch.object = object;
    touch.knots = s.triangles[triangle];
    touch.weights = at.weights;
    const Vector3d q = placeOf(s, touch), off = x - q;
    touch.side = 1;
    const Vector3d face = normalOf(s, touch);
    const double height = face.dot(off);
    // Organs are closed where they are tubes or bodies; of a sheet the node keeps the side that it came from.
    const bool closed = c.model.objects[object].tube.ringCount() > 1 || c.body(object).filled();
    if (!closed && side_before != 0 && object_before == object)
      touch.side = side_before;
    else if (!closed && height < 0.0)
      touch.side = -1;
    const double outward = touch.side < 0 ? -height : height, distance = std::sqrt(off.squaredNorm());
    plane.normal = outward > 0.0 && distance > 1e-7 ? Vector3d(off / distance)
                                                    : Vector3d(face * static_cast<double>(touch.side));
    plane.offset = plane.normal.dot(q) + kSlingRadius;
    plane.friction = c.model.description.objects[object].friction;
    plane.active = plane.normal.squaredNorm() > 0.5;
  }
  for (std::size_t o = 0; o < c.model.objects.size(); ++o) {  // rigid ones, where they are nearer
    const auto& grid = c.model.objects[o].grid;
    if (grid.empty()) continue;
    Eigen::Vector3f gradient;
    const double distance = grid.distance(x.cast<float>(), gradient);
    const double length = std::sqrt(static_cast<double>(gradient.squaredNorm()));
    if (!(distance < best) || !(length > 0.1)) continue;
    best = distance;
    plane.active = true;
    plane.normal = gradient.cast<double>() / length;
    plane.offset = plane.normal.dot(x) - distance + kSlingRadius;
    plane.friction = c.model.description.objects[o].friction;
    touch.side = 0;
  }
}

/// One step of an untied loop. `before`: its linkage as it was.
void moveLoop(Context& c, Sling& sling, const Sling& before) {
  LoopStep& step = c.scratch.loop_step;
  step.h = c.dt;
  step.gravity = c.state.gravity;
  for (int i = 0; i < kSlingNodes; ++i) {
    const SlingTouch& t = sling.touch[i];
    step.hanging_before[i] = interaction::hangingNode(before, before.rest, i);
    step.start[i] = t.on ? Vector3d(placeOf(c.state.objects[t.object], t) + t.offset) : sling.node[i];
  }
  LoopNodes x;
  interaction::swing(sling, step, x);
  Vector3d low = step.start[1], high = low;
  double furthest = 0.0;
  for (int i = 0; i < kSlingNodes; ++i) {
    low = low.cwiseMin(step.start[i]), high = high.cwiseMax(step.start[i]);
    furthest = std::max(furthest, (x[i] - step.start[i]).squaredNorm());
  }
  const double reach = kSlingRadius + kLoopMargin + std::sqrt(furthest);
  gatherCandidates(c, low - Vector3d::Constant(reach), high + Vector3d::Constant(reach));
  for (int i = 0; i < kSlingNodes; ++i)
    look(c, sling, step, i, std::sqrt((x[i] - step.start[i]).squaredNorm()));
  interaction::link(sling, step, x);
  for (int i = 0; i < kSlingNodes; ++i) {
    sling.velocity[i] = (x[i] - sling.node[i]) / c.dt;
    sling.node[i] = x[i];
    SlingTouch& t = sling.touch[i];
    const LoopPlane& p = step.planes[i];
    t.on = i > 0 && p.active && t.side != 0 && p.normal.dot(x[i]) - p.offset < kLies;
    if (!t.on) continue;
    const ObjectState& s = c.state.objects[t.object];
    t.weights = contact::nearest(x[i], {knotPosition(s, t.knots[0]), knotPosition(s, t.knots[1]),
                                        knotPosition(s, t.knots[2])})
                    .weights;
    t.offset = x[i] - placeOf(s, t);
  }
}

/// A tied loop lies where it was tied and goes with the tissue; between two nodes that lie on it, it is
/// straight.
void carryLoop(Context& c, Sling& sling) {
  LoopNodes x = sling.node;
  int first = -1;
  for (int i = 0; i < kSlingNodes; ++i) {
    SlingTouch& t = sling.touch[i];
    if (!t.on) continue;
    if (first < 0) first = i;
    const ObjectState& s = c.state.objects[t.object];
    const Vector3d n = normalOf(s, t);
    if (n.squaredNorm() > 0.5) t.offset = kSlingRadius * n;
    x[i] = placeOf(s, t) + t.offset;
  }
  if (first < 0) return;
  for (int from = first, n = 0; n < kSlingNodes;) {
    int to = 1;
    while (to < kSlingNodes && !sling.touch[(from + to) % kSlingNodes].on) ++to;
    const Vector3d a = x[from % kSlingNodes], b = x[(from + to) % kSlingNodes];
    for (int i = 1; i < to; ++i) x[(from + i) % kSlingNodes] = a + (b - a) * (static_cast<double>(i) / to);
    from += to, n += to;
  }
  for (int i = 0; i < kSlingNodes; ++i) sling.velocity[i] = (x[i] - sling.node[i]) / c.dt;
  sling.node = x;
}

Sling* free(Context& c) {
  auto& slings = c.state.fasteners.slings;
  for (Sling& s : slings)
    if (!s.alive) return &s;
  if (slings.size() >= interaction::kMaxSlings) return nullptr;
  slings.emplace_back();
  return &slings.back();
}

Sling* ownOf(WorldState& state, int tool) {
  for (Sling& s : state.fasteners.slings)
    if (s.alive && !s.tied && s.instrument == tool) return &s;
  return nullptr;
}

/// The applicator: its loop hangs ahead of the tip; drawn while the function is on.
void applySling(Context& c, int tool) {
  auto& fasteners = c.state.fasteners;
  const auto& proxy = c.state.proxies[tool];
  Sling* own = ownOf(c.state, tool);
  const bool present = proxy.present && proxy.tool == tools::ToolKind::SlingApplicator;
  if (!present) {  // untied, it slips off with its applicator
    if (own != nullptr) own->alive = false;
    return;
  }
  const bool draw = (c.input.tools[tool].functions & tools::kFunctionFire) != 0;
  const Eigen::Matrix3d r = proxy.pose.orientation.toRotationMatrix();
  const auto hang = [&](Sling& s) { s.tip = pusherOf(proxy), s.ahead = r.col(2), s.across = r.col(0); };
  if (c.scratch.threads && c.state.threads.pushers[tool].active) return;  // a thread is in it
  if (own == nullptr) {
    if (!fasteners.appliers[tool].loaded) return;  // it carried one loop; the next comes with the next one
    own = free(c);
    if (own == nullptr) {
      c.report.status = Status::Degraded;
      return;
    }
    *own = Sling{};
    own->alive = true;
    own->id = c.state.next_attachment++;
    own->instrument = static_cast<std::int8_t>(tool);
    hang(*own);
    for (int i = 0; i < kSlingNodes; ++i) own->node[i] = interaction::hangingNode(*own, own->rest, i);
  }
  fasteners.appliers[tool].drawn = draw;
  const Sling before = *own;
  hang(*own);
  own->drawing = draw;
  const double factor = base::exponential(-interaction::kSlingShortening * c.dt);
  if (draw)
    own->rest *= factor;
  else if (!own->around)
    own->rest = std::min(own->rest / factor, interaction::kSlingLength);  // it dilates
  moveLoop(c, *own, before);
  if (!draw && !own->around) return;
  if (own->count > 0 || !own->around) embrace(c, *own);
  if (own->count == 0) enclose(c, *own);
}

/// What lies under a taut loop bears no more.
bool crushes(Context& c, const Sling& sling) {
  if (!(sling.tension > 0.0)) return false;
  auto& under = c.scratch.objects[sling.object].shared;  // per knot
  std::fill(under.begin(), under.end(), std::uint16_t{0});
  for (const SlingTouch& t : sling.touch)
    if (t.on && t.object == sling.object)
      for (const std::uint32_t k : t.knots) under[k] = 1;
  return c.body(sling.object)
             .leastVolume(c.model.objects[sling.object], c.state.objects[sling.object], under) < kCrushed;
}

/// Ties the loop where it has closed what lies in it, and will keep it closed without the pusher, or
/// crushed as far as it can be: the knot is set on the tissue, and every node that has some near; l0 is the
/// way that lies there. A loop of that length holds no more than a circle of it.
void tieClosed(Context& c, Sling& sling) {
  const double most = crushes(c, sling) ? sling.area : interaction::kSlingClosed * sling.area;
  const ObjectState& s = c.state.objects[sling.object];
  if (areaOf(s, sling) > most || !liesOn(sling)) return;
  const Sling before = sling;
  for (SlingTouch& t : sling.touch) t.on = t.on || (t.side != 0 && t.object == sling.object);
  if (sling.count >= 3) layOnRing(s, sling, 0);
  const double way = pathOf(s, sling, LoopTissue{}, Vector3d::Zero(), nullptr, nullptr);
  if (way * way > 2.0 * kTurn * most) {
    sling = before;
    return;
  }
  sling.rest = std::min(sling.rest, way + kAround);
  sling.tied = true;
  sling.drawing = false;
  c.state.fasteners.appliers[sling.instrument].loaded = false;
  emit(c, ligated(c, sling));
}

}  // namespace

void fastenSlings(Context& c) {
  for (int t = 0; t < tools::kInstrumentCount; ++t) applySling(c, t);
  for (Sling& sling : c.state.fasteners.slings) {
    if (!sling.alive) continue;
    if (sling.tied) {
      carryLoop(c, sling);
      continue;
    }
    if (sling.around) tieClosed(c, sling);
  }
}

double slingClosure(const ObjectState& s, const Sling& sling) {
  if (!sling.around) return 0.0;
  const double least = interaction::kSlingClosed * sling.area;
  return std::clamp((sling.area - areaOf(s, sling)) / std::max(sling.area - least, 1e-12), 0.0, 1.0);
}

void attachSling(const WorldState& state, const Sling& sling, Attachment& a) {
  a.id = sling.id;
  a.kind = 2;  // vest_msgs/TissueAttachment SLING
  const std::uint32_t knot = knotIn(sling),
                      other = sling.count > 0 ? sling.knots[static_cast<std::size_t>(sling.count / 2)] : knot;
  a.anchor.object = sling.object;
  a.anchor.knots = {knot, other, knot, knot};
  a.anchor.weights = {0.5, 0.5, 0.0, 0.0};
  a.pose.translation() = sling.node[0];
  a.station = sling.station;
  a.closure = slingClosure(state.objects[sling.object], sling);
  a.instrument = sling.tied ? -1 : sling.instrument;
}

void drawSling(const Sling& sling, SlingView& view) {
  view.id = sling.id;
  view.around = sling.around;
  view.tied = sling.tied;
  view.object = sling.object;
  view.rest_length = sling.rest;
  view.tension = sling.tension;
  view.knot = sling.node[0];
  view.positions = sling.node;
}

}  // namespace vest::scene
