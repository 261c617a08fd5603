#include <algorithm>
#include <cmath>

#include "scratch.h"

namespace vest::fluid {
namespace {
constexpr float kFlood =
    0.05f;  ///< m: deeper than any pool of a patient; shallower ones are not looked at for an overflow
constexpr float kThinnest = 5e-5f;  ///< m: as the film of pools_body.inc that stays where it is

/// Greatest of a row, or 0. Eight at a time: the row is looked at in every step.
float greatest(const float* line, int count) {
  float lanes[8] = {};
  int c = 0;
  for (; c + 8 <= count; c += 8)
    for (int n = 0; n < 8; ++n) lanes[n] = line[c + n] > lanes[n] ? line[c + n] : lanes[n];
  for (; c < count; ++c) lanes[0] = line[c] > lanes[0] ? line[c] : lanes[0];
  float most = 0;
  for (const float lane : lanes) most = lane > most ? lane : most;
  return most;
}

}  // namespace

void stepPools(const Model& model, double gravity, double dt, State& state, Scratch& scratch) {
  ScratchData& s = scratch.data();
  Pools& w = state.pools;
  const int columns = model.columns, rows = model.rows;
  const auto cells = static_cast<std::size_t>(columns);
  // The rectangle that holds all water.
  int r0 = rows, r1 = -1, c0 = columns, c1 = -1;
  float deepest = 0;
  for (int r = 0; r < rows; ++r) {
    const float* const line = w.depth.data() + static_cast<std::size_t>(r) * cells;
    const float most = greatest(line, columns);
    if (!(most > 0)) continue;
    deepest = std::max(deepest, most);
    r0 = std::min(r0, r), r1 = r;
    int first = 0, last = columns - 1;
    while (!(line[first] > 0)) ++first;
    while (!(line[last] > 0)) --last;
    c0 = std::min(c0, first), c1 = std::max(c1, last);
  }
  s.wet_r0 = 0, s.wet_r1 = -1;
  if (r1 < 0) {
    if (state.step % 64 == 0) {
      std::fill(w.u.begin(), w.u.end(), 0.0f), std::fill(w.v.begin(), w.v.end(), 0.0f);
      std::fill(w.rise.begin(), w.rise.end(), 0.0f);
    }
    return;
  }
  // Gravity waves must not cross a cell in a step: c = sqrt(g h).
  const auto dx = static_cast<float>(model.parameters.pool_cell);
  const float speed = std::sqrt(static_cast<float>(gravity) * deepest) + 0.3f;
  const int parts = std::clamp(static_cast<int>(2.0f * speed * static_cast<float>(dt) / dx) + 1, 1, 64);
  // Water comes one cell further in each part: beyond this rectangle all is dry.
  r0 = std::max(0, r0 - parts), r1 = std::min(rows - 1, r1 + parts);
  c0 = std::max(0, c0 - parts), c1 = std::min(columns - 1, c1 + parts);
  s.wet_r0 = r0, s.wet_r1 = r1, s.wet_c0 = c0, s.wet_c1 = c1;
  const auto each = [&](auto&& f) {
    for (int r = r0; r <= r1; ++r) {
      const std::size_t line = static_cast<std::size_t>(r) * cells;
      for (std::size_t i = line + static_cast<std::size_t>(c0); i <= line + static_cast<std::size_t>(c1); ++i)
        f(i);
    }
  };
  each([&](std::size_t i) { s.old_surface[i] = w.depth[i]; });
  const Parameters& par = model.parameters;
  const PoolNumbers n{static_cast<float>(dt) / static_cast<float>(parts),
                      dx,
                      static_cast<float>(gravity),
                      static_cast<float>(0.5 * (par.water_viscosity + par.blood_viscosity) / par.density),
                      cells,
                      static_cast<std::size_t>(r0),
                      static_cast<std::size_t>(r1),
                      static_cast<std::size_t>(c0),
                      static_cast<std::size_t>(c1)};
  for (int part = 0; part < parts; ++part) {
    s.kernels->flow(n, s, w);
    followLevel(state, s);
  }
  const float inverse_dt = static_cast<float>(1.0 / dt);
  each([&](std::size_t i) { w.rise[i] = (w.depth[i] - s.old_surface[i]) * inverse_dt; });
  if (deepest < kFlood) return;
  // What rises above the box runs over its rim.
  const auto top = static_cast<float>(par.high[2]);
  const double area = par.pool_cell * par.pool_cell;
  each([&](std::size_t i) {
    const float room = std::max(0.0f, top - w.bed[i]);
    if (w.bed[i] <= kNoBed || w.depth[i] <= room) return;
    state.lost += static_cast<double>(w.depth[i] - room) * area;
    w.blood[i] *= room / w.depth[i], w.depth[i] = room;
  });
}

void dragPools(const Model& model, const Inputs& inputs, const State& state, ScratchData& s) {
  const Pools& w = state.pools;
  const Parameters& par = model.parameters;
  const auto columns = static_cast<std::size_t>(model.columns);
  const auto nu = static_cast<float>(0.5 * (par.water_viscosity + par.blood_viscosity) / par.density);
  const double mass = par.density * par.pool_cell * par.pool_cell * inputs.dt;
  for (int row = s.wet_r0; row <= s.wet_r1; ++row) {
    for (int column = s.wet_c0; column <= s.wet_c1; ++column) {
      const auto r = static_cast<std::size_t>(row);
      const std::size_t i = r * columns + static_cast<std::size_t>(column), u = i + r;
      if (w.depth[i] <= kDryDepth || w.bed_triangle[i] < 0) continue;
      const float x = 0.5f * (w.u[u] + w.u[u + 1]), y = 0.5f * (w.v[i] + w.v[i + columns]),
                  speed = std::sqrt(x * x + y * y), h = std::max(w.depth[i], kThinnest);
      if (speed < 1e-3f) continue;
      addShear(s, static_cast<std::uint32_t>(w.bed_triangle[i]),
               mass * static_cast<double>(speed * (3.0f * nu / h + kDrag * speed)));
    }
  }
}

void leaveFilms(const Model& model, const Inputs& inputs, State& state, ScratchData& s) {
  constexpr float kStays = 5e-5f;  // m: thinner does not flow (pools_body.inc)
  constexpr float kMixes = 1.0f;  // s: in which what has not set goes into liquid that stands on it (assumed)
  Pools& w = state.pools;
  const double area = model.parameters.pool_cell * model.parameters.pool_cell;
  const auto dt = static_cast<float>(std::max(0.0, state.time - w.filmed_at));
  w.filmed_at = state.time;
  for (std::size_t i = 0; i < w.depth.size(); ++i) {
    if (w.blood[i] > kDryDepth && onGround(w, s, i)) w.ground[i] = w.bed[i];
    if (w.film[i] > 0) {
      const double drying = w.depth[i] > kDryDepth ? 0.0 : inputs.drying;
      w.film_age[i] += dt * static_cast<float>(effects::ageing(static_cast<double>(w.film[i]), drying));
      if (w.depth[i] > kStays && onGround(w, s, i)) {
        const float before = w.film[i], keep = effects::setShare(w.film_age[i]);
        w.film[i] = before * (keep + (1 - keep) * kMixes / (kMixes + dt));
        w.depth[i] += before - w.film[i], w.blood[i] += before - w.film[i];
      }
    }
    if (!(w.blood[i] > 0) || w.depth[i] > kStays || w.bed_triangle[i] < 0) continue;
    const float before = w.depth[i];
    w.depth[i] = std::max(0.0f, w.depth[i] - w.blood[i]);
    const float left = before - w.depth[i];
    w.blood[i] = 0;
    if (onGround(w, s, i)) {
      w.film_age[i] *= w.film[i] / std::max(w.film[i] + left, 1e-12f);
      w.film[i] += left, w.ground[i] = w.bed[i];
    } else {
      addStain(state, s, static_cast<std::uint32_t>(w.bed_triangle[i]), area * static_cast<double>(left));
    }
  }
}

bool fillCell(const Model& model, State& state, int column, int row, double volume, double blood) {
  if (column < 0 || row < 0 || column >= model.columns || row >= model.rows || !(volume >= 0)) return false;
  const std::size_t i = static_cast<std::size_t>(row) * model.columns + column;
  if (state.pools.bed[i] <= kNoBed) return false;
  const double depth = volume / (model.parameters.pool_cell * model.parameters.pool_cell);
  state.pools.depth[i] += static_cast<float>(depth);
  state.pools.blood[i] += static_cast<float>(depth * std::clamp(blood, 0.0, 1.0));
  return true;
}

}  // namespace vest::fluid
