#include "vest_tissue/interaction/sling.h"

#include <algorithm>
#include <cmath>

#include "../scene/stages.h"
#include "vest_tissue/interaction/clip.h"
#include "vest_tissue/interaction/fasteners.h"
#include "vest_tissue/solver/elementary.h"

namespace vest::interaction {

using Eigen::Vector3d;

void remapSling(Sling& s, const net::KnotDoubling& cut, const Vector3d& place) {
  if (cut.plane_normal.dot(place - cut.plane_point) > 0.0)
    std::replace(s.knots.begin(), s.knots.begin() + s.count, cut.original, cut.copy);
}

Vector3d hangingLoop(const Sling& s, double length, double turns) {
  constexpr double kTurn = 6.283185307179586;
  const double radius = length / kTurn;
  return s.tip + radius * ((1.0 - solver::sineOfTurns(turns + 0.25)) * s.ahead +
                           solver::sineOfTurns(turns) * s.across);
}

}  // namespace vest::interaction

namespace vest::scene {
namespace {

using Eigen::Vector3d;
using interaction::Sling;
using net::Block;

constexpr double kPusher = 0.0112;  ///< m from the tip frame to the pusher's end, where the loop leaves it

Vector3d centreOf(const ObjectState& s, const Sling& sling) {
  Vector3d sum = Vector3d::Zero();
  for (int i = 0; i < sling.count; ++i) sum += knotPosition(s, sling.knots[i]);
  return sum / std::max(sling.count, 1);
}

double areaOf(const ObjectState& s, const Sling& sling) {
  std::array<Vector3d, interaction::kMaxSlingKnots> p;
  for (int i = 0; i < sling.count; ++i) p[i] = knotPosition(s, sling.knots[i]);
  return interaction::polygonArea(p.data(), sling.count);
}

Event eventOf(const Context& c, const Sling& sling) {
  Event e;
  e.kind = EventKind::Ligated;
  e.step = c.state.step;
  e.instrument = sling.instrument;
  e.object = sling.object;
  e.element = sling.knots[0];
  e.barycentric = {1.0, 0.0, 0.0, 0.0};
  e.position = centreOf(c.state.objects[sling.object], sling);
  e.station = sling.station;
  e.area = sling.area;
  e.force = sling.tension;
  return e;
}

/// Lays the loop around the tube whose centre line passes through it. With several: the one nearest to its
/// middle.
void embrace(Context& c, Sling& sling) {
  const double radius = sling.rest / 6.283185307179586;
  const Vector3d middle = sling.tip + radius * sling.ahead, normal = sling.ahead.cross(sling.across);
  double best = radius;
  for (std::size_t object = 0; object < c.model.objects.size(); ++object) {
    const net::TubeMap& tube = c.model.objects[object].tube;
    if (!c.model.objects[object].net || tube.ringCount() < 2) continue;
    const ObjectState& s = c.state.objects[object];
    const auto centre = [&](std::size_t r) {
      Vector3d sum = Vector3d::Zero();
      for (const auto k : tube.knots(r)) sum += knotPosition(s, k);
      return Vector3d(sum / static_cast<double>(std::max<std::size_t>(tube.knots(r).size(), 1)));
    };
    Vector3d p = centre(0);
    for (std::size_t r = 0; r + 1 < tube.ringCount(); ++r) {
      const Vector3d q = centre(r + 1);
      const double a = normal.dot(p - middle), b = normal.dot(q - middle);
      if ((a <= 0.0) != (b <= 0.0)) {
        const double t = a / (a - b);
        const double off = std::sqrt((p + t * (q - p) - middle).squaredNorm());
        const std::size_t ring = t > 0.5 ? r + 1 : r;
        const auto& knots = tube.knots(ring);
        // It must fit through: no organ wider than the loop.
        double wide = 0.0;
        for (const auto k : knots) wide = std::max(wide, (knotPosition(s, k) - centre(ring)).squaredNorm());
        const bool fits =
            knots.size() >= 3 && knots.size() <= interaction::kMaxSlingKnots && std::sqrt(wide) < radius;
        if (off < best && fits) {
          best = off;
          sling.around = true;
          sling.object = static_cast<std::uint16_t>(object);
          sling.station = tube.station(r) + t * (tube.station(r + 1) - tube.station(r));
          sling.count = static_cast<std::int32_t>(knots.size());
          std::copy(knots.begin(), knots.end(), sling.knots.begin());
        }
      }
      p = q;
    }
  }
  if (!sling.around) return;
  const ObjectState& s = c.state.objects[sling.object];
  sling.area = areaOf(s, sling);
  double nearest = 1e30;
  for (int i = 0; i < sling.count; ++i) {
    const double d = (knotPosition(s, sling.knots[i]) - sling.tip).squaredNorm();
    if (d < nearest) nearest = d, sling.knot = i;
  }
}

/// Length of the path around the ring and its gradient per knot, no unit.
double pathOf(const ObjectState& s, const Sling& sling,
              std::array<Vector3d, interaction::kMaxSlingKnots>& gradient) {
  double length = 0.0;
  std::fill_n(gradient.begin(), sling.count, Vector3d::Zero());
  for (int i = 0; i < sling.count; ++i) {
    const int j = (i + 1) % sling.count;
    const Vector3d d = knotPosition(s, sling.knots[j]) - knotPosition(s, sling.knots[i]);
    const double l = std::sqrt(d.squaredNorm());
    length += l;
    if (!(l > 1e-9)) continue;
    gradient[j] += d / l;
    gradient[i] -= d / l;
  }
  return length;
}

/// The path is not longer than l0: places are drawn in, and the path's lengthening is stopped by an impulse
/// along the gradient, limited by what a hand or a knot bears; beyond it the thread slips.
void tighten(Context& c, Sling& sling, double dt) {
  constexpr double kSmooth = 0.005;  // s: of the tension that is told
  ObjectState& s = c.state.objects[sling.object];
  std::array<Vector3d, interaction::kMaxSlingKnots> g;
  const double around =
      6.283185307179586 * interaction::kSlingRadius;  // the thread lies outside of the knots
  const double length = pathOf(s, sling, g), excess = length - (sling.rest - around);
  const double keep = std::min(1.0, dt / kSmooth);
  sling.tension -= keep * sling.tension;
  if (excess <= 0.0) return;
  const float* const w = row(s, Block::kInverseMass);
  double inverse = 0.0, rate = 0.0;
  for (int i = 0; i < sling.count; ++i) {
    inverse += w[sling.knots[i]] * g[i].squaredNorm();
    rate += g[i].dot(knotVelocity(s, sling.knots[i]));
  }
  if (!(inverse > 0.0)) return;
  const double wanted = sling.drawing ? -interaction::kSlingShortening * sling.rest : 0.0;
  const double needed = std::max((rate - wanted) / inverse, 0.0), most = interaction::kSlingTension * dt;
  const double impulse = std::min(needed, most);
  if (needed > most) sling.rest = length + around;
  const double draw = needed > most ? 0.0 : excess / inverse;
  sling.tension += keep * impulse / dt;
  double work = 0.0;
  for (int i = 0; i < sling.count; ++i) {
    const std::uint32_t k = sling.knots[i];
    const Vector3d before = knotVelocity(s, k), after = before - w[k] * impulse * g[i];
    const Vector3d place = knotPosition(s, k) - w[k] * draw * g[i];
    if (w[k] > 0.0f) work += 0.5 / w[k] * (after.squaredNorm() - before.squaredNorm());
    work += impulse / dt * w[k] * draw * g[i].squaredNorm();
    for (int axis = 0; axis < 3; ++axis) {
      s.block.row(static_cast<Block::KnotRow>(Block::X + axis))[k] = static_cast<float>(place[axis]);
      s.block.row(static_cast<Block::KnotRow>(Block::VX + axis))[k] = static_cast<float>(after[axis]);
    }
  }
  c.scratch.objects[sling.object].loads.work += work;
}

Sling* free(Context& c) {
  auto& slings = c.state.fasteners.slings;
  for (Sling& s : slings)
    if (!s.alive) return &s;
  if (slings.size() >= interaction::kMaxSlings) return nullptr;
  slings.emplace_back();
  return &slings.back();
}

/// The applicator: its loop hangs ahead of the tip; drawn while the function is on.
void apply(Context& c, int tool) {
  auto& fasteners = c.state.fasteners;
  const auto& proxy = c.state.proxies[tool];
  Sling* own = nullptr;
  for (Sling& s : fasteners.slings)
    if (s.alive && !s.tied && s.instrument == tool) own = &s;
  const bool present = proxy.present && proxy.tool == tools::ToolKind::SlingApplicator;
  if (!present) {  // untied, it slips off with its applicator
    if (own != nullptr) own->alive = false;
    return;
  }
  const bool draw = (c.input.tools[tool].functions & tools::kFunctionFire) != 0;
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
  }
  fasteners.appliers[tool].drawn = draw;
  const Eigen::Matrix3d r = proxy.pose.orientation.toRotationMatrix();
  own->tip = proxy.pose.tip + kPusher * r.col(2);
  own->drawing = draw;
  own->ahead = r.col(2);
  own->across = r.col(0);
  if (draw && !own->around) embrace(c, *own);
  if (draw) own->rest *= solver::exponential(-interaction::kSlingShortening * c.dt);
  if (!draw && !own->around) own->rest = interaction::kSlingLength;  // nothing in it: it opens again
}

}  // namespace

void fastenSlings(Context& c) {
  for (int t = 0; t < tools::kInstrumentCount; ++t) apply(c, t);
  for (Sling& sling : c.state.fasteners.slings) {
    if (!sling.alive || !sling.around) continue;
    if (sling.tied || areaOf(c.state.objects[sling.object], sling) > interaction::kSlingClosed * sling.area)
      continue;
    sling.tied = true;
    sling.drawing = false;
    c.state.fasteners.appliers[sling.instrument].loaded = false;
    emit(c, eventOf(c, sling));
  }
}

void holdSlings(Context& c, std::size_t object, double dt) {
  for (Sling& sling : c.state.fasteners.slings)
    if (sling.alive && sling.around && sling.object == object) tighten(c, sling, dt);
}

double slingClosure(const ObjectState& s, const Sling& sling) {
  if (!sling.around) return 0.0;
  const double least = interaction::kSlingClosed * sling.area;
  return std::clamp((sling.area - areaOf(s, sling)) / std::max(sling.area - least, 1e-12), 0.0, 1.0);
}

void drawSling(const WorldState& state, const Sling& sling, SlingView& view) {
  view.id = sling.id;
  view.around = sling.around;
  view.tied = sling.tied;
  view.object = sling.object;
  view.rest_length = sling.rest;
  view.tension = sling.tension;
  view.knot = sling.tip;
  const ObjectState& s = state.objects[sling.object];
  // Between hanging and lying on the organ: by how much of the slack is left.
  double hanging = 1.0, path = 0.0;
  std::array<Vector3d, interaction::kMaxSlingKnots> p, g;
  const Vector3d centre = centreOf(s, sling);
  if (sling.around) {
    path = pathOf(s, sling, g);
    hanging = sling.tied ? 0.0
                         : std::clamp((sling.rest - path) / std::max(interaction::kSlingLength - path, 1e-9),
                                      0.0, 1.0);
    for (int i = 0; i < sling.count; ++i) {
      const Vector3d out = knotPosition(s, sling.knots[i]) - centre;
      p[i] = knotPosition(s, sling.knots[i]) +
             out * (interaction::kSlingRadius / std::max(std::sqrt(out.squaredNorm()), 1e-9));
    }
    view.knot = hanging * sling.tip + (1.0 - hanging) * p[sling.knot];
  }
  for (int n = 0; n < interaction::kSlingNodes; ++n) {
    const double turns = static_cast<double>(n) / interaction::kSlingNodes;
    Vector3d place = interaction::hangingLoop(sling, sling.rest, turns);
    if (sling.around) {
      const double at = turns * sling.count;
      const int i = static_cast<int>(at) % sling.count;
      const double t = at - std::floor(at);
      const Vector3d lying =
          p[(sling.knot + i) % sling.count] * (1.0 - t) + p[(sling.knot + i + 1) % sling.count] * t;
      place = hanging * place + (1.0 - hanging) * lying;
    }
    view.positions[n] = place;
  }
}

}  // namespace vest::scene
