#include <algorithm>
#include <cmath>

#include "scratch.h"
#include "vest_effects/arithmetic.h"
#include "vest_tissue/solver/random.h"

namespace vest::fluid {
namespace {

constexpr float kAside = 0.032f;     ///< m, for what rests under an overhang (assumed)
constexpr float kFarthest = 0.096f;  ///< m, for what fell behind the wall: bounds the work

/// A particle's fluid into a cell: volume, blood, horizontal momentum.
void join(const Model& model, State& state, std::size_t cell, float volume, float blood, float vx, float vy) {
  Pools& w = state.pools;
  const auto area = static_cast<float>(model.parameters.pool_cell * model.parameters.pool_cell);
  const float depth = static_cast<float>(model.whole) * volume / area;
  const std::size_t r = cell / static_cast<std::size_t>(model.columns), u = cell + r;
  const float share = depth / (depth + std::max(w.depth[cell], 5e-4f));
  for (const std::size_t face : {u, u + 1}) w.u[face] += 0.5f * share * (vx - w.u[face]);
  for (const std::size_t face : {cell, cell + static_cast<std::size_t>(model.columns)})
    w.v[face] += 0.5f * share * (vy - w.v[face]);
  w.depth[cell] += depth;
  w.blood[cell] += depth * blood;
}

/// @return the nearest cell whose bed lies between two heights, within `far` cells; else their number
std::size_t nearestOpenCell(const Model& model, const Pools& w, int c, int r, float low, float high,
                            int far) {
  std::size_t best = w.bed.size();
  int distance = 1 << 30;
  for (int dr = -far; dr <= far; ++dr) {
    for (int dc = -far; dc <= far; ++dc) {
      const int cc = c + dc, rr = r + dr;
      if (cc < 0 || rr < 0 || cc >= model.columns || rr >= model.rows) continue;
      const std::size_t i = static_cast<std::size_t>(rr) * model.columns + cc;
      if (w.bed[i] <= kNoBed || w.bed[i] > high || w.bed[i] < low) continue;
      if (dr * dr + dc * dc < distance) distance = dr * dr + dc * dc, best = i;
    }
  }
  return best;
}

/// Air that a plunging jet drags along, over its own volume: 0.04 Fr^0.28 (L/d)^0.4 with L/d = 10
/// (Biń 1993, Chem. Eng. Sci. 48, 3585–3630, doi:10.1016/0009-2509(93)81019-R).
double entrainment(double speed, double diameter) {
  const double froude = speed * speed / (9.81 * diameter);
  return froude > 1 ? 0.04 * effects::power(froude, 0.28) * 2.51 : 0.0;
}

void plunge(const Model& model, const Inputs& inputs, State& state, ScratchData& s, std::size_t i,
            std::size_t cell) {
  const Particles& q = state.particles;
  Pools& w = state.pools;
  const Parameters& par = model.parameters;
  const double area = par.pool_cell * par.pool_cell, volume = model.whole * static_cast<double>(q.volume[i]);
  const float vz = q.vz[i];
  // Its vertical momentum is a pressure on the pool for this step, and the tissue below bears it.
  const double gravity = std::max(0.1, -inputs.gravity[2]);
  w.head[cell] +=
      static_cast<float>(volume * static_cast<double>(std::max(0.0f, -vz)) / (gravity * inputs.dt * area));
  w.head[cell] = std::min(w.head[cell], 0.01f);
  if (w.bed_triangle[cell] >= 0) {
    const auto id = static_cast<std::uint32_t>(w.bed_triangle[cell]);
    PlacedTriangle t{};
    t.id = id;
    const float weights[3] = {1.0f / 3, 1.0f / 3, 1.0f / 3};
    const double mass = wholeMass(model, q.blood[i]) * static_cast<double>(q.volume[i]);
    addMomentum(s, t, weights, 0.0, 0.0, mass * static_cast<double>(vz), mass);
  }
  const double speed = std::sqrt(static_cast<double>(q.vx[i] * q.vx[i] + q.vy[i] * q.vy[i] + vz * vz));
  state.air += volume * entrainment(speed, 2 * par.spacing);
  Bubbles& b = state.bubbles;
  const auto random = [&](std::uint64_t k) {
    return static_cast<float>(solver::randomUniform(inputs.seed, state.step, 5000000 + 8 * i + k));
  };
  const float radius =
      0.0006f + 0.0012f * random(0);  // m: millimetres, as jets of this size make them (assumed)
  const double bubble = 4.18879020478639 * static_cast<double>(radius) * static_cast<double>(radius) *
                        static_cast<double>(radius);
  if (state.air < bubble) return;
  state.air = std::min(state.air - bubble, 1e-6);
  if (b.count == b.x.size()) return;
  const std::size_t k = b.count++;
  b.x[k] = q.x[i] + 0.004f * (random(1) - 0.5f);
  b.y[k] = q.y[i] + 0.004f * (random(2) - 0.5f);
  b.z[k] = w.bed[cell] + (w.top(cell) - w.bed[cell]) * random(3);
  b.radius[k] = radius;
  b.left[k] =
      0.5f + 2.0f * random(4);  // s at the surface: foam of bloody water lasts about so long (assumed)
}

}  // namespace

bool overBed(const Model& model, const State& state, std::size_t i) {
  const int c = columnOf(model, state.particles.x[i]), r = rowOf(model, state.particles.y[i]);
  return c >= 0 && r >= 0 && c < model.columns && r < model.rows &&
         state.pools.bed[static_cast<std::size_t>(r) * static_cast<std::size_t>(model.columns) +
                         static_cast<std::size_t>(c)] > kNoBed;
}

void drown(const Model& model, State& state, std::size_t i) {
  const Particles& q = state.particles;
  const int c = columnOf(model, q.x[i]), r = rowOf(model, q.y[i]);
  // No farther aside than it has flown, and a cell.
  const float way = q.age[i] * std::sqrt(q.vx[i] * q.vx[i] + q.vy[i] * q.vy[i] + q.vz[i] * q.vz[i]);
  const int far =
      1 + static_cast<int>(std::min(kFarthest, way) / static_cast<float>(model.parameters.pool_cell));
  const std::size_t cell = nearestOpenCell(model, state.pools, c, r, -1e2f, 1e2f, far);
  if (cell < state.pools.bed.size()) {
    join(model, state, cell, q.volume[i], q.blood[i], 0, 0);
  } else {
    state.lost += model.whole * static_cast<double>(q.volume[i]);
  }
}

void absorb(const Model& model, const Inputs& inputs, State& state, ScratchData& s) {
  Particles& q = state.particles;
  Pools& w = state.pools;
  const Parameters& par = model.parameters;
  const auto d = static_cast<float>(par.spacing), patience = static_cast<float>(par.rest_time);
  const int rest_cells = std::max(1, static_cast<int>(kAside / static_cast<float>(par.pool_cell)));
  std::fill(w.head.begin(), w.head.end(), 0.0f);
  for (std::size_t i = 0; i < q.count; ++i) {
    if (q.volume[i] <= 0) continue;
    const float p[3] = {q.x[i], q.y[i], q.z[i]};
    bool inside = true;
    for (int a = 0; a < 3; ++a)
      inside &= p[a] >= static_cast<float>(par.low[a]) && p[a] < static_cast<float>(par.high[a]);
    if (!inside) {
      // What fell below all tissue began behind the cavity's wall, as where a vessel in it is cut: to the
      // nearest pool. What went elsewhere is lost, also what is no number.
      if (p[2] < static_cast<float>(par.low[2]) && std::fabs(p[0]) < 1e3f && std::fabs(p[1]) < 1e3f) {
        drown(model, state, i);
      } else {
        state.lost += model.whole * static_cast<double>(q.volume[i]);
      }
      q.volume[i] = 0;
      continue;
    }
    const int c = std::min(model.columns - 1, columnOf(model, p[0])),
              r = std::min(model.rows - 1, rowOf(model, p[1]));
    const std::size_t cell = static_cast<std::size_t>(r) * model.columns + c;
    const float bed = w.bed[cell], depth = w.top(cell) - bed;
    if (bed > kNoBed && depth > 0.5f * d && p[2] < bed + depth + 0.25f * d && p[2] > bed - 2 * d) {
      plunge(model, inputs, state, s, i, cell);
      join(model, state, cell, q.volume[i], q.blood[i], q.vx[i], q.vy[i]);
      q.volume[i] = 0;
    } else if (q.rest[i] > patience) {
      const std::size_t target =
          bed > kNoBed && p[2] > bed - d
              ? cell
              : nearestOpenCell(model, w, c, r, p[2] - 0.02f, p[2] + 2 * d, rest_cells);
      if (target < w.bed.size()) {
        join(model, state, target, q.volume[i], q.blood[i], q.vx[i], q.vy[i]);
        q.volume[i] = 0;
      } else {
        q.rest[i] = 1e-6f;  // under an overhang: tries again after the same time
      }
    }
  }
}

void stepBubbles(const Model& model, const Inputs& inputs, State& state) {
  Bubbles& b = state.bubbles;
  const Pools& w = state.pools;
  const auto dt = static_cast<float>(inputs.dt);
  std::size_t kept = 0;
  for (std::size_t k = 0; k < b.count; ++k) {
    float x = b.x[k], y = b.y[k], z = b.z[k], left = b.left[k];
    const int c = columnOf(model, x), r = rowOf(model, y);
    if (c < 0 || r < 0 || c >= model.columns || r >= model.rows) continue;
    const std::size_t i = static_cast<std::size_t>(r) * model.columns + c,
                      u = i + static_cast<std::size_t>(r);
    if (w.depth[i] < 0.5f * b.radius[k]) continue;  // it lies dry: burst
    x += dt * 0.5f * (w.u[u] + w.u[u + 1]);
    y += dt * 0.5f * (w.v[i] + w.v[i + static_cast<std::size_t>(model.columns)]);
    // Millimetre bubbles rise at 0.2 to 0.25 m/s (Clift, Grace and Weber 1978, fig. 7.3).
    const float surface = w.top(i);
    z = std::min(z + 0.22f * dt, surface);
    if (z >= surface - b.radius[k]) left -= dt;
    if (left <= 0) continue;
    b.x[kept] = x, b.y[kept] = y, b.z[kept] = z, b.radius[kept] = b.radius[k], b.left[kept] = left;
    ++kept;
  }
  b.count = kept;
}

}  // namespace vest::fluid
