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

double ringPath(const ObjectState& s, const Sling& sling) {
  double length = 0.0;
  for (int i = 0; i < sling.count; ++i)
    length +=
        std::sqrt((knotPosition(s, sling.knots[(i + 1) % sling.count]) - knotPosition(s, sling.knots[i]))
                      .squaredNorm());
  return length;
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
    g[count] = Vector3d::Zero();
    p[count++] = held ? knot : placeOf(s, t);
  }
  double length = 0.0;
  for (int i = 0; i < count && count > 1; ++i) {
    const int j = (i + 1) % count;
    const Vector3d d = p[j] - p[i];
    const double l = std::sqrt(d.squaredNorm());
    length += l;
    if (!(l > 1e-9)) continue;
    g[j] += d / l;
    g[i] -= d / l;
  }
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

/// The path is not longer than l0: places are drawn in, and the path's lengthening is stopped by an impulse
/// along its gradient, limited by what a hand or a knot bears; beyond it the thread slips through its knot.
void tighten(Context& c, Sling& sling, const LoopTissue& loop, double fraction, double dt) {
  constexpr double kSmooth = 0.005;  // s: of the tension that is told
  ObjectState& s = c.state.objects[sling.object];
  ObjectScratch& o = c.scratch.objects[sling.object];
  std::array<Vector3d, LoopTissue::kMost> g;
  Vector3d at_knot;
  const Vector3d knot = loop.knot + fraction * loop.travel;
  const double length = pathOf(s, sling, loop, knot, &g, &at_knot), excess = length - (sling.rest - kAround);
  const double keep = std::min(1.0, dt / kSmooth);
  sling.tension -= keep * sling.tension;
  if (excess <= 0.0) return;
  const float* const w = row(s, Block::kInverseMass);
  double inverse = 0.0, rate = loop.held ? at_knot.dot(loop.travel) / c.dt : 0.0;
  for (int i = 0; i < loop.count; ++i) {
    inverse += w[loop.knots[i]] * g[i].squaredNorm();
    rate += g[i].dot(knotVelocity(s, loop.knots[i]));
  }
  if (!(inverse > 0.0)) return;
  const double wanted = sling.drawing ? -interaction::kSlingShortening * sling.rest : 0.0;
  const double needed = std::max((rate - wanted) / inverse, 0.0), most = interaction::kSlingTension * dt;
  const double impulse = std::min(needed, most);
  if (needed > most) sling.rest = length + kAround;
  const double draw = needed > most ? 0.0 : excess / inverse;
  sling.tension += keep * impulse / dt;
  double work = 0.0;
  for (int i = 0; i < loop.count; ++i) {
    const std::uint32_t k = loop.knots[i];
    const Vector3d before = knotVelocity(s, k), after = before - w[k] * impulse * g[i];
    const Vector3d place = knotPosition(s, k) - w[k] * draw * g[i];
    if (w[k] > 0.0f) work += 0.5 / w[k] * (after.squaredNorm() - before.squaredNorm());
    work += impulse / dt * w[k] * draw * g[i].squaredNorm();
    for (int axis = 0; axis < 3; ++axis) {
      s.block.row(static_cast<Block::KnotRow>(Block::X + axis))[k] = static_cast<float>(place[axis]);
      s.block.row(static_cast<Block::KnotRow>(Block::VX + axis))[k] = static_cast<float>(after[axis]);
    }
  }
  o.loads.work += work;
  if (!loop.held) return;
  // What the thread does to the pusher.
  contact::ToolLoad& load = o.loads.tools[sling.instrument];
  const Vector3d push = -impulse * at_knot, moment = knot.cross(push);
  load.touched = true;
  for (int e = 0; e < 3; ++e) load.impulse[e] += push[e], load.moment[e] += moment[e];
}

/// A tube in the loop is no wider than the loop, wherever the nodes lie: the same for the ring of its knots,
/// which nothing but the loop holds.
void tightenRing(Context& c, Sling& sling, double dt) {
  ObjectState& s = c.state.objects[sling.object];
  const double excess = ringPath(s, sling) - (sling.rest - kAround);
  if (sling.count < 3 || excess <= 0.0) return;
  std::array<Vector3d, interaction::kMaxSlingKnots> g;
  std::fill_n(g.begin(), sling.count, Vector3d::Zero());
  for (int i = 0; i < sling.count; ++i) {
    const int j = (i + 1) % sling.count;
    const Vector3d d = knotPosition(s, sling.knots[j]) - knotPosition(s, sling.knots[i]);
    const double l = std::sqrt(d.squaredNorm());
    if (!(l > 1e-9)) continue;
    g[j] += d / l;
    g[i] -= d / l;
  }
  const float* const w = row(s, Block::kInverseMass);
  double inverse = 0.0, rate = 0.0;
  for (int i = 0; i < sling.count; ++i) {
    inverse += w[sling.knots[i]] * g[i].squaredNorm();
    rate += g[i].dot(knotVelocity(s, sling.knots[i]));
  }
  if (!(inverse > 0.0)) return;
  const double wanted = sling.drawing ? -interaction::kSlingShortening * sling.rest : 0.0;
  const double impulse = std::min(std::max((rate - wanted) / inverse, 0.0), interaction::kSlingTension * dt);
  double work = 0.0;
  for (int i = 0; i < sling.count; ++i) {
    const std::uint32_t k = sling.knots[i];
    const Vector3d before = knotVelocity(s, k), after = before - w[k] * impulse * g[i];
    const Vector3d place = knotPosition(s, k) - w[k] * (excess / inverse) * g[i];
    if (w[k] > 0.0f) work += 0.5 / w[k] * (after.squaredNorm() - before.squaredNorm());
    work += impulse / dt * w[k] * (excess / inverse) * g[i].squaredNorm();
    for (int axis = 0; axis < 3; ++axis) {
      s.block.row(static_cast<Block::KnotRow>(Block::X + axis))[k] = static_cast<float>(place[axis]);
      s.block.row(static_cast<Block::KnotRow>(Block::VX + axis))[k] = static_cast<float>(after[axis]);
    }
  }
  sling.tension += std::min(1.0, dt / 0.005) * impulse / dt;
  c.scratch.objects[sling.object].loads.work += work;
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
    if (loop.count > 0) tighten(c, sling, loop, fraction, dt);
    tightenRing(c, sling, dt);
  }
}

}  // namespace vest::scene
