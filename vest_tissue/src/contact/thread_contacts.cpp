#include <algorithm>
#include <cmath>

#include "../scene/between_jaws.h"
#include "../scene/channels.h"
#include "../scene/loops.h"
#include "../suture/contacts.h"
#include "vest_tissue/scene/cavity_walls.h"

/// What threads may touch in a step: tissue, rigid objects, instruments.
namespace vest::scene {
namespace {

using Eigen::Vector3d;
using interaction::ThreadTouch;
using interaction::TouchKind;

constexpr std::uint32_t kGroup = 8;  ///< nodes of a box
constexpr double kSearched = 0.005;  ///< m: candidates are triangles that are no further than this (tuned)
constexpr double kServes = 0.0015;   ///< m: way of both sides for which they serve; more may come in a step
constexpr double kCalm = 0.0002;     ///< m: way in a step that one part serves (tuned)
constexpr double kThreadRounding = 1e-7;  ///< m, of distances and ways in single precision
constexpr double kAhead = 0.001;  ///< m: touches are prepared this much before they touch, and more where
                                  ///< the thread is fast (tuned)

struct Box {
  Vector3d low, high;
  bool apart(const Vector3d& l, const Vector3d& h, double reach) const {
    return (l.array() > high.array() + reach).any() || (h.array() < low.array() - reach).any();
  }
};
Box boxOf(const std::vector<Vector3d>& x, std::uint32_t first, std::uint32_t end) {
  Box box{x[first], x[first]};
  for (std::uint32_t i = first + 1; i < end; ++i)
    box.low = box.low.cwiseMin(x[i]), box.high = box.high.cwiseMax(x[i]);
  return box;
}

/// m: what a place may move in a step.
double wayOf(const Context& c, std::uint32_t place) {
  const ThreadPlace& p = c.model.threads.places[place];
  const suture::State& rod = c.state.threads.rod;
  const double v = std::sqrt(rod.velocity[p.rigid ? p.segment : place].squaredNorm());
  return 1.5 * c.dt * (p.rigid ? v + std::sqrt(rod.spin[p.segment].squaredNorm() * p.arm.squaredNorm()) : v);
}

bool isStale(const Context& c, const ThreadScratch& w) {
  if (!w.known) return true;
  const auto& x = w.now;
  double squared = 0.0, tissue = 0.0;
  for (std::size_t i = 0; i < x.size(); ++i)
    squared = std::max(squared, (x[i] - w.searched[i]).squaredNorm());
  for (std::size_t k = 0; k < w.way.size(); ++k) tissue = std::max(tissue, c.state.objects[k].way - w.way[k]);
  return std::sqrt(squared) + tissue > kServes;
}

void searchCandidates(Context& c, ThreadScratch& w) {
  const auto nodes = static_cast<std::uint32_t>(w.now.size());
  w.known = true;
  w.candidates.clear();
  std::copy(w.now.begin(), w.now.end(), w.searched.begin());
  const Box all = boxOf(w.now, 0, nodes);
  for (std::size_t object = 0; object < c.model.objects.size(); ++object) {
    const ObjectState& s = c.state.objects[object];
    w.way[object] = s.way;
    if (!c.model.objects[object].deforms) continue;
    const double reach = kSearched + c.model.description.objects[object].contact_thickness;
    for (std::uint32_t t = 0; t < s.triangles.size(); ++t) {
      const auto& k = s.triangles[t];
      const std::array<Vector3d, 3> p{knotPosition(s, k[0]), knotPosition(s, k[1]), knotPosition(s, k[2])};
      const Vector3d low = p[0].cwiseMin(p[1]).cwiseMin(p[2]), high = p[0].cwiseMax(p[1]).cwiseMax(p[2]);
      if (!s.triangle_alive[t] || all.apart(low, high, reach)) continue;
      for (std::uint32_t first = 0; first < nodes; first += kGroup) {
        const std::uint32_t end = std::min(first + kGroup, nodes);
        if (boxOf(w.now, first, end).apart(low, high, reach)) continue;
        for (std::uint32_t i = first; i < end; ++i) {
          if (!c.model.threads.places[i].touches || w.apart[i] != 0) continue;
          const double distance = contact::nearest(w.now[i], p).distance;
          if (!(distance < reach)) continue;
          if (w.candidates.size() == w.candidates.capacity())
            w.full = true;
          else
            w.candidates.push_back({i, static_cast<std::uint16_t>(object), t, static_cast<float>(distance)});
        }
      }
    }
  }
  std::sort(w.candidates.begin(), w.candidates.end(), [](const ThreadCandidate& a, const ThreadCandidate& b) {
    return a.node != b.node       ? a.node < b.node
           : a.object != b.object ? a.object < b.object
                                  : a.triangle < b.triangle;
  });
}

const ThreadTouch* find(const Context& c, const ThreadTouch& touch) {
  const auto& kept = c.state.threads.touches;
  const auto at = std::lower_bound(kept.begin(), kept.end(), touch,
                                   [](const auto& a, const auto& b) { return interaction::before(a, b); });
  return at != kept.end() && !interaction::before(touch, *at) ? &*at : nullptr;
}

/// It did so in the step before: it keeps its side however deep it goes.
bool touched(const Context& c, std::uint32_t node, std::uint16_t object) {
  ThreadTouch touch;
  touch.segment = node, touch.body = object;
  return find(c, touch) != nullptr;
}

/// The touch as it was in the step before, or a new one.
ThreadReach& reach(Context& c, ThreadScratch& w, std::uint32_t segment, TouchKind kind, std::size_t body,
                   std::size_t part) {
  ThreadTouch touch;
  touch.segment = segment, touch.kind = kind;
  touch.body = static_cast<std::uint16_t>(body), touch.part = static_cast<std::uint8_t>(part);
  const ThreadTouch* known = find(c, touch);
  if (w.reaches.size() == w.reaches.capacity()) {
    w.full = true;
    w.reaches.pop_back();
  }
  ThreadReach& r = w.reaches.emplace_back();
  r.touch = known != nullptr ? *known : touch;
  if (known == nullptr) r.touch.side = 0;
  return r;
}

void reachTissue(Context& c, ThreadScratch& w) {
  for (std::size_t k = 0; k < w.candidates.size();) {
    const ThreadCandidate first = w.candidates[k];
    const ObjectState& s = c.state.objects[first.object];
    const Vector3d& x = w.now[first.node];
    const double near =
        c.model.description.objects[first.object].contact_thickness + 2.0 * kAhead + wayOf(c, first.node);
    const Within within = w.apart[first.node] != 0 ? Within::Channel : withinOf(c, first.node, first.object);
    double least = kSearched;
    std::uint32_t best = suture::kNone;
    const auto look = [&](std::uint32_t t) {
      if (within == Within::Channel || t >= s.triangles.size() || !s.triangle_alive[t]) return;
      const auto& n = s.triangles[t];
      const std::array<Vector3d, 3> p{knotPosition(s, n[0]), knotPosition(s, n[1]), knotPosition(s, n[2])};
      if (!meets(c, first.node, Vector3d((p[1] - p[0]).cross(p[2] - p[0])), within)) return;
      const double found = contact::nearest(x, p).distance;
      if (found < least || (found == least && t < best && best != suture::kNone)) least = found, best = t;
    };
    // That which was nearest goes first: most others were too far off to have come nearer since.
    std::size_t nearest = k, end = k;
    for (; end < w.candidates.size() && w.candidates[end].node == first.node &&
           w.candidates[end].object == first.object;
         ++end)
      if (w.candidates[end].distance < w.candidates[nearest].distance) nearest = end;
    look(w.candidates[nearest].triangle);
    const double moved = std::sqrt((x - w.searched[first.node]).squaredNorm()) + s.way - w.way[first.object];
    for (; k < end; ++k)
      if (k != nearest && w.candidates[k].distance <= least + moved + kThreadRounding)
        look(w.candidates[k].triangle);
    if (best == suture::kNone) continue;
    if (least > near && !touched(c, first.node, first.object)) continue;
    ThreadReach& r = reach(c, w, first.node, TouchKind::Tissue, first.object, 0);
    r.triangle = best;
    if (within == Within::Tissue) {
      if (r.touch.side != -1) r.touch.shear.setZero();
      r.touch.side = -1;
    }
    if (r.touch.side != 0) continue;
    // New: from outside of what is closed, else from where it comes.
    const auto& n = s.triangles[best];
    const Vector3d p0 = knotPosition(s, n[0]),
                   face = (knotPosition(s, n[1]) - p0).cross(knotPosition(s, n[2]) - p0);
    r.touch.side = c.model.objects[first.object].closed || face.dot(x - p0) >= 0.0 ? 1 : -1;
  }
}

void reachRigid(Context& c, ThreadScratch& w) {
  const CavityWalls hanging(c.model, c.state, c.input.sunk);
  for (std::size_t object = 0; object < c.model.objects.size(); ++object) {
    const contact::DistanceGrid& grid = c.model.objects[object].grid;
    if (grid.empty()) continue;
    for (std::uint32_t i = 0; i < w.now.size(); ++i) {
      if (!c.model.threads.places[i].touches || w.apart[i] != 0) continue;
      const Eigen::Vector3f x = w.now[i].cast<float>();
      Eigen::Vector3f gradient;
      float nearest = grid.distance(x, gradient);
      const bool hangs = hanging.lower(object, x, nearest, gradient);
      const double distance = nearest;
      const double length = std::sqrt(static_cast<double>(gradient.squaredNorm()));
      if (distance > 2.0 * kAhead + wayOf(c, i) || !(length > 0.1)) continue;
      ThreadReach& r = reach(c, w, i, TouchKind::Rigid, object, hangs ? kHangs : 0);
      r.touch.side = 1;
      r.normal = r.normal_then = gradient.cast<double>() / length;
      r.place = r.place_then = w.now[i] - distance * r.normal;
    }
  }
}

/// Jaws of an instrument in this step, as far as threads meet them.
struct Jaws {
  bool open = false;  ///< they have inner faces that hold or cut
  const tools::ToolGeometry* geometry = nullptr;
  JawFrame before, after;
};

void reachFaces(Context& c, ThreadScratch& w, std::uint32_t i, int t, const Jaws& jaws) {
  const auto& pose = c.state.proxies[t].pose;
  const interaction::HalfAngle now = interaction::halfAngle(pose.jaw),
                               then = interaction::halfAngle(c.scratch.proxies_before[t].pose.jaw);
  const Vector3d hinge(0, 0, -jaws.geometry->jaw_length);
  for (int side = 0; side < 2; ++side) {
    ThreadReach& r =
        reach(c, w, i, TouchKind::JawFace, static_cast<std::size_t>(t), static_cast<std::size_t>(side));
    r.touch.side = 1;
    const double sign = side == 0 ? -1.0 : 1.0;
    r.normal = jaws.after.rotation * Vector3d(sign * now.cosine, 0, now.sine);
    r.normal_then = jaws.before.rotation * Vector3d(sign * then.cosine, 0, then.sine);
    r.place = jaws.after.world(hinge), r.place_then = jaws.before.world(hinge);
  }
}

/// Jaws that hold a thread are pressed together over their width, where their capsules leave a groove: one
/// more lies between them, behind the tool's others.
bool fillGroove(Context& c, int t, const Jaws& jaws) {
  const int k = c.scratch.capsule_count[t];
  if (!c.state.threads.grips[t].active || jaws.geometry->jaw[0].empty() || k >= interaction::kMaxToolCapsules)
    return false;
  const double radius = jaws.geometry->jaw[0].back().radius;
  const Vector3d a(0, 0, radius - jaws.geometry->jaw_length), b(0, 0, -radius);
  c.scratch.capsules_before[t][k] = {jaws.before.world(a), jaws.before.world(b), radius, 0};
  c.scratch.capsules_after[t][k] = {jaws.after.world(a), jaws.after.world(b), radius, 0};
  return true;
}

void reachTools(Context& c, ThreadScratch& w) {
  const suture::State& rod = c.state.threads.rod;
  for (int t = 0; t < tools::kInstrumentCount; ++t) {
    const auto& proxy = c.state.proxies[t];
    if (!proxy.present) continue;
    const auto& then = c.scratch.proxies_before[t].pose;
    Jaws jaws;
    jaws.geometry = &tools::toolGeometry(proxy.tool);
    jaws.open = interaction::hasJaws(proxy.tool) || proxy.tool == tools::ToolKind::Scissors;
    jaws.before = {then.orientation.toRotationMatrix(), then.tip};
    jaws.after = {proxy.pose.orientation.toRotationMatrix(), proxy.pose.tip};
    const interaction::ThreadGrip& grip = c.state.threads.grips[t];
    const interaction::NeedleGrip& on = c.state.threads.needle_grips[t];
    const int capsules = c.scratch.capsule_count[t] + (fillGroove(c, t, jaws) ? 1 : 0);
    const auto held = [&grip](std::uint32_t i) {
      for (int k = 0; grip.active && k < grip.count; ++k)
        if (i + 3 >= grip.nodes[k].node && i <= grip.nodes[k].node + 3) return true;
      return false;
    };
    // Jaws that hold are closed to all else.
    const auto inJaws = [&](std::uint32_t i, bool needle) {
      return jaws.open && !(needle ? on.active : grip.active) &&
             isBetween(c, t, *jaws.geometry, jaws.before, i);
    };
    // Places from first to end make a chain; of a thread node by node, of a needle point by point.
    const auto chain = [&](std::uint32_t first_place, std::uint32_t end_place, bool needle, double radius) {
      for (std::uint32_t first = first_place; first < end_place; first += kGroup) {
        const std::uint32_t end = std::min(first + kGroup + 1, end_place);
        const Box box = boxOf(w.now, first, end);
        for (int k = 0; k < capsules; ++k) {
          const auto &b = c.scratch.capsules_before[t][k], &a = c.scratch.capsules_after[t][k];
          const double way = std::sqrt(std::max((a.a - b.a).squaredNorm(), (a.b - b.b).squaredNorm()));
          double own = 0.0;
          for (std::uint32_t i = first; i < end; ++i) own = std::max(own, wayOf(c, i));
          const double near = a.radius + radius + kAhead + way + own;
          if (box.apart(a.a.cwiseMin(a.b), a.a.cwiseMax(a.b), near)) continue;
          for (std::uint32_t i = first; i + 1 < end; ++i) {
            if ((!needle && (rod.severed[i] != 0 || held(i) || w.apart[i] != 0 || atPusher(c, t, i))) ||
                (a.which >= 0 && (inJaws(i, needle) || inJaws(i + 1, needle))))
              continue;
            const suture::Closest at =
                suture::closest(w.now[i], w.now[i + 1] - w.now[i], a.a, a.b - a.a, false);
            if (at.between.squaredNorm() > near * near) continue;
            // A node that ends two segments counts once.
            if (at.s == 1.0 && i + 2 < end_place && (needle || rod.severed[i + 1] == 0)) continue;
            reach(c, w, i, TouchKind::Tool, static_cast<std::size_t>(t), static_cast<std::size_t>(k));
          }
        }
        for (std::uint32_t i = first; i < std::min(first + kGroup, end_place); ++i)
          if (inJaws(i, needle)) reachFaces(c, w, i, t, jaws);
      }
    };
    const ThreadModel& m = c.model.threads;
    for (const suture::Strand& strand : m.rods->strands)
      chain(strand.threadFirst(), strand.first + strand.nodes, false, strand.section.radius);
    for (std::uint32_t n = 0; n < m.first_point.size(); ++n)
      if (!on.active || on.needle != n)
        chain(m.first_point[n],
              m.first_point[n] + static_cast<std::uint32_t>(m.rods->needles[n].points.size()), true,
              m.rods->needles[n].radius);
  }
}

/// Slow threads that nobody pulls press with their weight alone: one part serves, whose touches are softer.
/// One serves a loop in its pusher, too, as long as no thread touches tissue: nothing else gives way by it.
int partsOf(const Context& c, const ThreadScratch& w) {
  const interaction::ThreadState& t = c.state.threads;
  const auto active = [](const auto& grip) { return grip.active; };
  bool calm =
      std::none_of(t.grips.begin(), t.grips.end(), active) &&
      std::none_of(t.needle_grips.begin(), t.needle_grips.end(), active) &&
      std::none_of(t.channels.begin(), t.channels.end(), [](const auto& hole) { return hole.filled; });
  const bool pushed = std::any_of(t.pushers.begin(), t.pushers.end(), active);
  if (calm && pushed)
    return std::none_of(w.reaches.begin(), w.reaches.end(),
                        [](const ThreadReach& r) { return r.touch.kind == TouchKind::Tissue; })
               ? 1
               : c.model.threads.steps;
  for (const ThreadReach& r : w.reaches)
    calm = calm && r.touch.kind != TouchKind::Tool && r.touch.kind != TouchKind::JawFace;
  for (std::uint32_t i = 0; i < w.now.size() && calm; ++i) calm = wayOf(c, i) < kCalm;
  return calm ? 1 : c.model.threads.steps;
}

}  // namespace

void touchThreads(Context& c) {
  if (!c.scratch.threads) return;
  ThreadScratch& w = *c.scratch.threads;
  w.reaches.clear();
  w.full = w.faulty = false;
  for (std::size_t i = 0; i < w.now.size(); ++i) w.now[i] = c.model.threads.at(c.state.threads.rod, i);
  if (isStale(c, w)) searchCandidates(c, w);
  reachTissue(c, w);
  reachRigid(c, w);
  reachTools(c, w);
  w.parts = partsOf(c, w);
}

}  // namespace vest::scene
