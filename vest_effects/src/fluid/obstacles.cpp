#include <algorithm>
#include <cmath>

#include "scratch.h"

namespace vest::fluid {
namespace {

using Point = std::array<float, 3>;

Point minus(const Point& a, const Point& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}
float dot(const Point& a, const Point& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/// Share 0 … 1 of a way at which it comes as near as `reach` to the line through a along `axis` (unit); 0
/// where it begins nearer, 1 where it never does.
float firstTouch(const Point& from, const Point& way, const Point& a, const Point& axis, float reach) {
  Point p = minus(from, a), w = way;
  const float along = dot(p, axis), go = dot(w, axis);
  for (std::size_t i = 0; i < 3; ++i) p[i] -= along * axis[i], w[i] -= go * axis[i];
  const float square = dot(w, w), toward = dot(p, w), rest = dot(p, p) - reach * reach;
  if (rest < 0) return 0;
  const float root = toward * toward - square * rest;
  return toward < 0 && root > 0 ? std::min(1.0f, (-toward - std::sqrt(root)) / square) : 1.0f;
}

}  // namespace

void turnAway(const Model& model, const Inputs& inputs, State& state, const ScratchData& scratch) {
  Particles& q = state.particles;
  const auto dt = static_cast<float>(inputs.dt), keep = 1.0f - static_cast<float>(model.parameters.friction),
             back = static_cast<float>(model.parameters.restitution);
  const float half = 0.5f * static_cast<float>(model.parameters.spacing);
  for (int k = 0; k < inputs.obstacle_count; ++k) {
    const Obstacle& o = inputs.obstacles[static_cast<std::size_t>(k)];
    Point a, along, speed, low, high;
    const auto reach = static_cast<float>(o.radius) + half;
    for (std::size_t i = 0; i < 3; ++i) {
      a[i] = static_cast<float>(o.a[i]), along[i] = static_cast<float>(o.b[i] - o.a[i]);
      speed[i] = static_cast<float>(o.velocity[i]);
      low[i] = std::min(a[i], a[i] + along[i]) - reach, high[i] = std::max(a[i], a[i] + along[i]) + reach;
    }
    const float length = std::sqrt(dot(along, along));
    if (!(length > 0)) continue;
    const Point axis{along[0] / length, along[1] / length, along[2] / length};
    for (std::size_t n = 0; n < q.count; ++n) {
      const Point now{q.x[n], q.y[n], q.z[n]}, from{scratch.px[n], scratch.py[n], scratch.pz[n]};
      bool near = q.age[n] > kOwnNozzle;
      for (std::size_t i = 0; near && i < 3; ++i)
        near = std::min(now[i], from[i]) < high[i] && std::max(now[i], from[i]) > low[i];
      if (!near) continue;
      // Its way as the instrument sees it.
      Point way = minus(now, from);
      for (std::size_t i = 0; i < 3; ++i) way[i] -= dt * speed[i];
      const Point start = minus(now, way);
      const float touch = firstTouch(start, way, a, axis, reach);
      const bool struck = touch > 0;  // else it lies on it or was caught: it slides on
      const float s = struck ? touch : 1;
      Point off;
      for (std::size_t i = 0; i < 3; ++i) off[i] = start[i] + s * way[i] - a[i];
      const float t = std::clamp(dot(off, axis), 0.0f, length);
      for (std::size_t i = 0; i < 3; ++i) off[i] -= t * axis[i];
      const float distance = std::sqrt(dot(off, off));
      if (!(distance < 1.001f * reach) || !(distance > 1e-6f)) continue;
      Point v{q.vx[n] - speed[0], q.vy[n] - speed[1], q.vz[n] - speed[2]}, place;
      float in = 0;
      for (std::size_t i = 0; i < 3; ++i) off[i] /= distance, in += v[i] * off[i];
      // What strikes loses its speed along the normal and keeps a part of the rest; what leaves is let go.
      for (std::size_t i = 0; i < 3; ++i) {
        place[i] = a[i] + t * axis[i] + reach * off[i];
        if (in < 0) v[i] = (v[i] - in * off[i]) * keep - back * in * off[i];
      }
      // What is caught between tissue and instrument is not squeezed into the tissue.
      if (struck) q.x[n] = place[0], q.y[n] = place[1], q.z[n] = place[2];
      q.vx[n] = v[0] + speed[0], q.vy[n] = v[1] + speed[1], q.vz[n] = v[2] + speed[2];
    }
  }
}

}  // namespace vest::fluid
