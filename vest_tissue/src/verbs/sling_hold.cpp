#include <algorithm>
#include <cmath>

#include "../scene/sling_path.h"
#include "vest_tissue/interaction/fasteners.h"

namespace vest::scene {

using Eigen::Vector3d;
using interaction::kSlingNodes;
using interaction::Sling;
using interaction::SlingTouch;
using net::Block;

Vector3d placeOf(const ObjectState& s, const SlingTouch& t) {
  Vector3d p = Vector3d::Zero();
  for (int e = 0; e < 3; ++e) p += t.weights[e] * knotPosition(s, t.knots[e]);
  return p;
}

Vector3d pusherOf(const interaction::Proxy& proxy) {
  return proxy.pose.tip + kPusher * (proxy.pose.orientation * Vector3d::UnitZ());
}

namespace {

/// Length of a closed way over places, m, and its gradient to each, no unit.
double closedWay(const Vector3d* p, int count, Vector3d* g) {
  double length = 0.0;
  for (int i = 0; i < count; ++i) g[i].setZero();
  for (int i = 0; i < count && count > 1; ++i) {
    const int j = (i + 1) % count;
    const Vector3d d = p[j] - p[i];
    const double l = std::sqrt(d.squaredNorm());
    length += l;
    if (!(l > 1e-9)) continue;
    g[j] += d / l;
    g[i] -= d / l;
  }
  return length;
}

}  // namespace

double ringPath(const ObjectState& s, const Sling& sling, Vector3d* gradient) {
  std::array<Vector3d, interaction::kMaxSlingKnots> p, g;
  for (int i = 0; i < sling.count; ++i) p[i] = knotPosition(s, sling.knots[i]);
  return closedWay(p.data(), sling.count, gradient != nullptr ? gradient : g.data());
}

double pathOf(const ObjectState& s, const Sling& sling, const LoopTissue& loop, const Vector3d& knot,
              std::array<Vector3d, LoopTissue::kMost>* gradient, Vector3d* at_knot) {
  std::array<Vector3d, kSlingNodes> p, g;
  std::array<int, kSlingNodes> node;
  int count = 0;
  for (int i = 0; i < kSlingNodes; ++i) {
    const SlingTouch& t = sling.touch[i];
    const bool held = i == 0 && loop.held;
    if (!held && !(t.on && t.object == sling.object)) continue;
    node[count] = i;
    p[count++] = held ? knot : placeOf(s, t);
  }
  const double length = closedWay(p.data(), count, g.data());
  if (gradient == nullptr) return length;
  std::fill_n(gradient->begin(), loop.count, Vector3d::Zero());
  at_knot->setZero();
  for (int i = 0; i < count; ++i) {
    if (node[i] == 0 && loop.held) {
      *at_knot = g[i];
      continue;
    }
    const SlingTouch& t = sling.touch[node[i]];
    for (int e = 0; e < 3; ++e) (*gradient)[loop.slot[node[i]][e]] += t.weights[e] * g[i];
  }
  return length;
}

namespace {

constexpr double kSmooth = 0.005;  // s: of the tension that is told

/// A way over knots is not longer than l0: they are drawn in by `excess` (m), and its lengthening, `rate`
/// (m/s) and what the knots do, is stopped by an impulse along its gradient `g`. A hand or a knot bears only
/// so much: beyond it the thread may slip through its knot and draw nothing in. @param slips whether it may;
/// whether it does @return N·s; < 0: nothing moves
double draw(Context& c, Sling& sling, const std::uint32_t* knots, const Vector3d* g, int count, double excess,
            double rate, double dt, bool& slips) {
  ObjectState& s = c.state.objects[sling.object];
  const float* const w = row(s, Block::kInverseMass);
  double inverse = 0.0;
  for (int i = 0; i < count; ++i) {
    inverse += w[knots[i]] * g[i].squaredNorm();
    rate += g[i].dot(knotVelocity(s, knots[i]));
  }
  if (!(inverse > 0.0)) return -1.0;
  const double wanted = sling.drawing ? -interaction::kSlingShortening * sling.rest : 0.0;
  const double needed = std::max((rate - wanted) / inverse, 0.0), most = interaction::kSlingTension * dt;
  const double impulse = std::min(needed, most);
  slips = slips && needed > most;
  // What the sub-step lengthened is taken back, what was too long before it no faster than a thread runs.
  const double by = slips ? 0.0 : std::min(excess, (std::max(rate, 0.0) + kDrawn) * dt) / inverse;
  sling.tension += std::min(1.0, dt / kSmooth) * impulse / dt;
  double work = 0.0;
  for (int i = 0; i < count; ++i) {
    const std::uint32_t k = knots[i];
    const Vector3d before = knotVelocity(s, k), after = before - w[k] * impulse * g[i];
    const Vector3d place = knotPosition(s, k) - w[k] * by * g[i];
    if (w[k] > 0.0f) work += 0.5 / w[k] * (after.squaredNorm() - before.squaredNorm());
    work += impulse / dt * w[k] * by * g[i].squaredNorm();
    setMotion(s, k, place, after);
  }
  c.scratch.objects[sling.object].loads.work += work;
  return impulse;
}

/// The way over the nodes, and over the pusher's knot where it holds it.
void tighten(Context& c, Sling& sling, const LoopTissue& loop, double fraction, double dt) {
  std::array<Vector3d, LoopTissue::kMost> g;
  Vector3d at_knot;
  const Vector3d knot = loop.knot + fraction * loop.travel;
  const double length = pathOf(c.state.objects[sling.object], sling, loop, knot, &g, &at_knot);
  const double excess = length - (sling.rest - kAround);
  if (excess <= 0.0) return;
  bool slips = true;
  const double impulse = draw(c, sling, loop.knots.data(), g.data(), loop.count, excess,
                              loop.held ? at_knot.dot(loop.travel) / c.dt : 0.0, dt, slips);
  if (impulse < 0.0) return;
  if (slips) sling.rest = length + kAround;
  if (loop.held)  // what the thread does to the pusher
    give(c.scratch.objects[sling.object].loads.tools[sling.instrument], -impulse * at_knot, knot);
}

/// A tube in the loop is no wider than the loop, wherever the nodes lie: the same for the ring of its knots,
/// which nothing but the loop holds.
void tightenRing(Context& c, Sling& sling, double dt) {
  std::array<Vector3d, interaction::kMaxSlingKnots> g;
  const double length = ringPath(c.state.objects[sling.object], sling, g.data());
  const double excess = length - (sling.rest - kAround);
  if (sling.count < 3 || excess <= 0.0) return;
  bool slips = sling.tied;
  draw(c, sling, sling.knots.data(), g.data(), sling.count, excess, 0.0, dt, slips);
  if (slips) sling.rest = length + kAround;
}

}  // namespace

void gatherSlings(Context& c) {
  auto& slings = c.state.fasteners.slings;
  for (std::size_t n = 0; n < slings.size(); ++n) {
    const Sling& sling = slings[n];
    LoopTissue& loop = c.scratch.loops[n];
    loop.count = 0;
    loop.held = false;
    if (!sling.alive || !sling.around) continue;
    const auto& proxy = c.state.proxies[static_cast<std::size_t>(sling.instrument)];
    loop.held = !sling.tied && proxy.present && proxy.tool == tools::ToolKind::SlingApplicator;
    if (!sling.tied && !loop.held) continue;  // it leaves with its applicator
    loop.knot = sling.tip;
    loop.travel = loop.held ? Vector3d(pusherOf(proxy) - sling.tip) : Vector3d(Vector3d::Zero());
    for (int i = 0; i < kSlingNodes; ++i) {
      const SlingTouch& t = sling.touch[i];
      if (!t.on || t.object != sling.object) continue;
      for (int e = 0; e < 3; ++e) {
        const auto end = loop.knots.begin() + loop.count, at = std::find(loop.knots.begin(), end, t.knots[e]);
        if (at == end) loop.knots[loop.count++] = t.knots[e];
        loop.slot[i][e] = static_cast<std::uint8_t>(at - loop.knots.begin());
      }
    }
  }
}

void holdSlings(Context& c, std::size_t object, double fraction, double dt) {
  auto& slings = c.state.fasteners.slings;
  for (std::size_t n = 0; n < slings.size(); ++n) {
    Sling& sling = slings[n];
    const LoopTissue& loop = c.scratch.loops[n];
    if (!sling.alive || !sling.around || sling.object != object || !(sling.tied || loop.held)) continue;
    sling.tension -= std::min(1.0, dt / kSmooth) * sling.tension;
    // Once tied the way lies on the ring: held twice, each would undo what the other did.
    if (loop.count > 0 && !(sling.tied && sling.count >= 3)) tighten(c, sling, loop, fraction, dt);
    tightenRing(c, sling, dt);
  }
}

}  // namespace vest::scene
