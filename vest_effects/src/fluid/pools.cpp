#include <algorithm>
#include <cmath>

#include "scratch.h"

namespace vest::fluid {
namespace {

constexpr float kFilm = 5e-5f;   ///< m: a film as thin as this stays where it is (assumed)
constexpr float kDrag = 0.005f;  ///< bed friction c_f of a smooth bed, tau = c_f rho u² (Chow 1959, order of)

/// One direction of the momentum equation on a staggered grid (Stelling and Duinmeijer 2003,
/// doi:10.1002/fld.537): upwind depth, advection that conserves momentum, well balanced at rest by comparing
/// surfaces above the higher bed.
struct Direction {
  std::size_t step, across;    ///< strides of cells along and across
  std::size_t fstep, facross;  ///< strides of this direction's faces
  std::size_t gstep, gacross;  ///< strides of the other direction's faces
  int line0, line1;            ///< lines across, both included
  int face0, face1;            ///< faces along; beyond these two there is no water
};

struct Numbers {
  float dt, dx, gravity, nu;
};

/// Depth of each side of a face above the higher bed.
inline float upwind(float low, float high, float velocity) {
  return velocity > 0 ? low : (velocity < 0 ? high : std::max(low, high));
}

/// Depths at the faces, and the flux with the old velocity, which advection needs of the neighbours too.
void depths(const Pools& w, const Direction& d, const std::vector<float>& own, std::vector<float>& low,
            std::vector<float>& high, std::vector<float>& flux) {
  for (int line = d.line0; line <= d.line1; ++line) {
    for (int k = d.face0; k <= d.face1; ++k) {
      const std::size_t f =
          static_cast<std::size_t>(k) * d.fstep + static_cast<std::size_t>(line) * d.facross;
      low[f] = high[f] = flux[f] = 0;
      if (k == d.face0 || k == d.face1) continue;
      const std::size_t j = static_cast<std::size_t>(k) * d.step + static_cast<std::size_t>(line) * d.across,
                        i = j - d.step;
      const float di = w.depth[i], dj = w.depth[j];
      if (di <= kDryDepth && dj <= kDryDepth) continue;
      const float bi = w.bed[i], bj = w.bed[j];
      if (bi <= kNoBed || bj <= kNoBed) continue;
      const float sill = std::max(bi, bj);
      low[f] = di > kDryDepth ? std::max(0.0f, bi + di - sill) : 0.0f;
      high[f] = dj > kDryDepth ? std::max(0.0f, bj + dj - sill) : 0.0f;
      flux[f] = upwind(low[f], high[f], own[f]) * own[f];
    }
  }
}

void accelerate(const Pools& w, const Direction& d, const std::vector<float>& own,
                const std::vector<float>& other, const Numbers& n, const std::vector<float>& low,
                const std::vector<float>& high, const std::vector<float>& flux, std::vector<float>& next) {
  const float limit = 0.4f * n.dx / n.dt;
  for (int line = d.line0; line <= d.line1; ++line) {
    const std::size_t start = static_cast<std::size_t>(line) * d.facross;
    next[start + static_cast<std::size_t>(d.face0) * d.fstep] = 0;
    next[start + static_cast<std::size_t>(d.face1) * d.fstep] = 0;
    for (int k = d.face0 + 1; k < d.face1; ++k) {
      const std::size_t f = static_cast<std::size_t>(k) * d.fstep + start;
      const float u = own[f], h = upwind(low[f], high[f], u);
      if (h < kFilm) {
        next[f] = 0;
        continue;
      }
      const std::size_t j = static_cast<std::size_t>(k) * d.step + static_cast<std::size_t>(line) * d.across,
                        i = j - d.step;
      const float mean = std::max(0.5f * (w.depth[i] + w.depth[j]), kFilm);
      const float before = 0.5f * (flux[f - d.fstep] + flux[f]), after = 0.5f * (flux[f] + flux[f + d.fstep]);
      float advect = after * ((after > 0 ? u : own[f + d.fstep]) - u) -
                     before * ((before > 0 ? own[f - d.fstep] : u) - u);
      // Across: the other direction's flow carries this momentum over the two side faces.
      const std::size_t g =
          static_cast<std::size_t>(k) * d.gstep + static_cast<std::size_t>(line) * d.gacross;
      const float side0 = 0.5f * (other[g - d.gstep] * w.depth[i] + other[g] * w.depth[j]),
                  side1 = 0.5f *
                          (other[g - d.gstep + d.gacross] * w.depth[i] + other[g + d.gacross] * w.depth[j]);
      if (line < d.line1) advect += side1 * ((side1 > 0 ? u : own[f + d.facross]) - u);
      if (line > d.line0) advect -= side0 * ((side0 > 0 ? own[f - d.facross] : u) - u);
      const float drop = (low[f] + w.head[i]) - (high[f] + w.head[j]);
      const float drag = 3.0f * n.nu / (h * h) + kDrag * std::fabs(u) / h;
      const float v = (u + n.dt / n.dx * (n.gravity * drop - advect / mean)) / (1.0f + n.dt * drag);
      next[f] = std::clamp(v, -limit, limit);
    }
  }
}

/// New velocities into the State, and the flux with the depth upwind of them.
void take(const Direction& d, const std::vector<float>& next, const std::vector<float>& low,
          const std::vector<float>& high, std::vector<float>& own, std::vector<float>& flux) {
  for (int line = d.line0; line <= d.line1; ++line) {
    for (int k = d.face0; k <= d.face1; ++k) {
      const std::size_t f =
          static_cast<std::size_t>(k) * d.fstep + static_cast<std::size_t>(line) * d.facross;
      own[f] = next[f];
      flux[f] = upwind(low[f], high[f], own[f]) * own[f];
    }
  }
}

/// No cell gives more than it has; blood goes with the water of the cell that it comes from.
void limit(const Pools& w, const Direction& d, const std::vector<float>& share, std::vector<float>& flux,
           std::vector<float>& blood) {
  for (int line = d.line0; line <= d.line1; ++line) {
    for (int k = d.face0; k <= d.face1; ++k) {
      const std::size_t f =
          static_cast<std::size_t>(k) * d.fstep + static_cast<std::size_t>(line) * d.facross;
      if (flux[f] == 0) {
        blood[f] = 0;
        continue;
      }
      const std::size_t j = static_cast<std::size_t>(k) * d.step + static_cast<std::size_t>(line) * d.across,
                        from = flux[f] > 0 ? j - d.step : j;
      flux[f] *= share[from];
      blood[f] = flux[f] * (w.depth[from] > 0 ? std::min(1.0f, w.blood[from] / w.depth[from]) : 0.0f);
    }
  }
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
    for (int c = 0; c < columns; ++c) {
      if (!(line[c] > 0)) continue;
      r0 = std::min(r0, r), r1 = r, c0 = std::min(c0, c), c1 = std::max(c1, c);
      deepest = std::max(deepest, line[c]);
    }
  }
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
  const auto each = [&](auto&& f) {
    for (int r = r0; r <= r1; ++r) {
      const std::size_t line = static_cast<std::size_t>(r) * cells;
      for (std::size_t i = line + static_cast<std::size_t>(c0); i <= line + static_cast<std::size_t>(c1); ++i)
        f(i, i + static_cast<std::size_t>(r));
    }
  };
  each([&](std::size_t i, std::size_t) { s.old_surface[i] = w.depth[i]; });
  const Parameters& par = model.parameters;
  const Numbers n{static_cast<float>(dt) / static_cast<float>(parts), dx, static_cast<float>(gravity),
                  static_cast<float>(0.5 * (par.water_viscosity + par.blood_viscosity) / par.density)};
  const Direction along{1, cells, 1, cells + 1, 1, cells, r0, r1, c0, c1 + 1};
  const Direction up{cells, 1, cells, 1, cells + 1, 1, c0, c1, r0, r1 + 1};
  const float ratio = n.dt / n.dx;
  for (int part = 0; part < parts; ++part) {
    depths(w, along, w.u, s.low_u, s.high_u, s.face_u);
    depths(w, up, w.v, s.low_v, s.high_v, s.face_v);
    accelerate(w, along, w.u, w.v, n, s.low_u, s.high_u, s.face_u, s.new_u);
    accelerate(w, up, w.v, w.u, n, s.low_v, s.high_v, s.face_v, s.new_v);
    take(along, s.new_u, s.low_u, s.high_u, w.u, s.face_u);
    take(up, s.new_v, s.low_v, s.high_v, w.v, s.face_v);
    each([&](std::size_t i, std::size_t f) {
      const float give = ratio * (std::max(0.0f, -s.face_u[f]) + std::max(0.0f, s.face_u[f + 1]) +
                                  std::max(0.0f, -s.face_v[i]) + std::max(0.0f, s.face_v[i + cells]));
      s.share[i] = give > w.depth[i] ? w.depth[i] / give : 1.0f;
    });
    limit(w, along, s.share, s.face_u, s.new_u);
    limit(w, up, s.share, s.face_v, s.new_v);
    each([&](std::size_t i, std::size_t f) {
      const float change = ratio * (s.face_u[f] - s.face_u[f + 1] + s.face_v[i] - s.face_v[i + cells]);
      if (change == 0 && w.depth[i] == 0) return;
      const float blood = ratio * (s.new_u[f] - s.new_u[f + 1] + s.new_v[i] - s.new_v[i + cells]);
      w.depth[i] = std::max(0.0f, w.depth[i] + change);
      w.blood[i] = std::clamp(w.blood[i] + blood, 0.0f, w.depth[i]);
    });
  }
  const float inverse_dt = static_cast<float>(1.0 / dt);
  each([&](std::size_t i, std::size_t) { w.rise[i] = (w.depth[i] - s.old_surface[i]) * inverse_dt; });
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

void findPools(const Model& model, const State& state, double least, double film, std::size_t most,
               std::vector<std::uint32_t>& labels, std::vector<PoolPatch>& pools) {
  const Pools& w = state.pools;
  labels.assign(w.depth.size(), 0);
  pools.clear();
  std::vector<std::size_t> stack;
  const double area = model.parameters.pool_cell * model.parameters.pool_cell;
  std::uint32_t label = 0;
  for (std::size_t seed = 0; seed < w.depth.size(); ++seed) {
    if (labels[seed] || !(static_cast<double>(w.depth[seed]) > film)) continue;
    PoolPatch p;
    p.label = ++label;
    int c0 = model.columns, c1 = -1, r0 = model.rows, r1 = -1;
    stack.push_back(seed);
    labels[seed] = label;
    while (!stack.empty()) {
      const std::size_t i = stack.back();
      stack.pop_back();
      const int c = static_cast<int>(i % static_cast<std::size_t>(model.columns)),
                r = static_cast<int>(i / static_cast<std::size_t>(model.columns));
      c0 = std::min(c0, c), c1 = std::max(c1, c), r0 = std::min(r0, r), r1 = std::max(r1, r);
      p.volume += static_cast<double>(w.depth[i]) * area, p.blood += static_cast<double>(w.blood[i]) * area;
      const int dc[] = {1, -1, 0, 0}, dr[] = {0, 0, 1, -1};
      for (int k = 0; k < 4; ++k) {
        const int cc = c + dc[k], rr = r + dr[k];
        if (cc < 0 || rr < 0 || cc >= model.columns || rr >= model.rows) continue;
        const std::size_t j = static_cast<std::size_t>(rr) * model.columns + cc;
        if (labels[j] || !(static_cast<double>(w.depth[j]) > film)) continue;
        labels[j] = label;
        stack.push_back(j);
      }
    }
    p.column = c0, p.row = r0, p.columns = c1 - c0 + 1, p.rows = r1 - r0 + 1;
    if (p.volume >= least) pools.push_back(p);
  }
  std::stable_sort(pools.begin(), pools.end(),
                   [](const PoolPatch& a, const PoolPatch& b) { return a.volume > b.volume; });
  if (pools.size() > most) pools.resize(most);
}

}  // namespace vest::fluid
