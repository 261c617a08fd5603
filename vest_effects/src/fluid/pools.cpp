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
  int cells, lines;            ///< along, across
  std::size_t step, across;    ///< strides of cells
  std::size_t fstep, facross;  ///< strides of this direction's faces
  std::size_t gstep, gacross;  ///< strides of the other direction's faces
};

struct Numbers {
  float dt, dx, gravity, nu;
};

/// Upwind depth of the face between cells i and j, and the surface that drives it.
inline float faceDepth(const Pools& w, std::size_t i, std::size_t j, float velocity, float& drop) {
  const float bi = w.bed[i], bj = w.bed[j];
  if (bi <= kNoBed || bj <= kNoBed) return drop = 0, 0.0f;
  const float sill = std::max(bi, bj);
  const float si = w.depth[i] > kDryDepth ? bi + w.depth[i] : bi,
              sj = w.depth[j] > kDryDepth ? bj + w.depth[j] : bj;
  const float hi = std::max(0.0f, si - sill), hj = std::max(0.0f, sj - sill);
  drop = (hi + w.head[i]) - (hj + w.head[j]);
  if (velocity > 0) return hi;
  if (velocity < 0) return hj;
  return std::max(hi, hj);
}

/// Lines line0 … line1, faces k0 … k1 along them; beyond these there is no water.
void faces(const Pools& w, const Direction& d, const std::vector<float>& own, const std::vector<float>& other,
           const Numbers& n, int line0, int line1, int k0, int k1, std::vector<float>& depth,
           std::vector<float>& next) {
  const float limit = 0.4f * n.dx / n.dt;
  // Depth at faces first: advection needs the flux of the neighbours too.
  for (int line = line0; line <= line1; ++line) {
    for (int k = k0; k <= k1; ++k) {
      const std::size_t f =
          static_cast<std::size_t>(k) * d.fstep + static_cast<std::size_t>(line) * d.facross;
      if (k == k0 || k == k1) {
        depth[f] = next[f] = 0;
        continue;
      }
      const std::size_t j = static_cast<std::size_t>(k) * d.step + static_cast<std::size_t>(line) * d.across;
      float drop;
      depth[f] = faceDepth(w, j - d.step, j, own[f], drop);
    }
  }
  for (int line = line0; line <= line1; ++line) {
    for (int k = k0 + 1; k < k1; ++k) {
      const std::size_t f =
          static_cast<std::size_t>(k) * d.fstep + static_cast<std::size_t>(line) * d.facross;
      const std::size_t j = static_cast<std::size_t>(k) * d.step + static_cast<std::size_t>(line) * d.across,
                        i = j - d.step;
      const float u = own[f];
      float drop;
      const float h = faceDepth(w, i, j, u, drop);
      if (h < kFilm) {
        next[f] = 0;
        continue;
      }
      const float mean = std::max(0.5f * (w.depth[i] + w.depth[j]), kFilm);
      const float before = 0.5f * (depth[f - d.fstep] * own[f - d.fstep] + depth[f] * u),
                  after = 0.5f * (depth[f] * u + depth[f + d.fstep] * own[f + d.fstep]);
      float advect = after * ((after > 0 ? u : own[f + d.fstep]) - u) -
                     before * ((before > 0 ? own[f - d.fstep] : u) - u);
      // Across: the other direction's flow carries this momentum over the two side faces.
      const std::size_t g =
          static_cast<std::size_t>(k) * d.gstep + static_cast<std::size_t>(line) * d.gacross;
      const float side0 = 0.5f * (other[g - d.gstep] * w.depth[i] + other[g] * w.depth[j]),
                  side1 = 0.5f *
                          (other[g - d.gstep + d.gacross] * w.depth[i] + other[g + d.gacross] * w.depth[j]);
      if (line < d.lines - 1) advect += side1 * ((side1 > 0 ? u : own[f + d.facross]) - u);
      if (line > 0) advect -= side0 * ((side0 > 0 ? own[f - d.facross] : u) - u);
      const float drag = 3.0f * n.nu / (h * h) + kDrag * std::fabs(u) / h;
      const float v = (u + n.dt / n.dx * (n.gravity * drop - advect / mean)) / (1.0f + n.dt * drag);
      next[f] = std::clamp(v, -limit, limit);
    }
  }
}

}  // namespace

void stepPools(const Model& model, double gravity, double dt, State& state, Scratch& scratch) {
  ScratchData& s = scratch.data();
  Pools& w = state.pools;
  const int columns = model.columns, rows = model.rows;
  // Lines with water, and one more on each side.
  int first = rows, last = -1;
  for (int r = 0; r < rows; ++r) {
    const float* const line = w.depth.data() + static_cast<std::size_t>(r) * columns;
    bool wet = false;
    for (int c = 0; c < columns; ++c) wet |= line[c] > 0;
    if (wet) first = std::min(first, r), last = r;
  }
  if (last < 0) {
    if (state.step % 64 == 0) {
      std::fill(w.u.begin(), w.u.end(), 0.0f), std::fill(w.v.begin(), w.v.end(), 0.0f);
      std::fill(w.rise.begin(), w.rise.end(), 0.0f);
    }
    return;
  }
  // Gravity waves must not cross a cell in a step: c = sqrt(g h).
  float deepest = 0;
  const auto cells = static_cast<std::size_t>(columns);
  for (std::size_t i = static_cast<std::size_t>(first) * cells;
       i < static_cast<std::size_t>(last + 1) * cells; ++i)
    deepest = std::max(deepest, w.depth[i]);
  const auto dx = static_cast<float>(model.parameters.pool_cell);
  const float speed = std::sqrt(static_cast<float>(gravity) * deepest) + 0.3f;
  const int parts = std::clamp(static_cast<int>(2.5f * speed * static_cast<float>(dt) / dx) + 1, 1, 64);
  // Water comes one line further in each part: beyond these lines all is dry.
  first = std::max(0, first - parts), last = std::min(rows - 1, last + parts);
  const std::size_t c0 = static_cast<std::size_t>(first) * cells,
                    c1 = static_cast<std::size_t>(last + 1) * cells;
  std::copy_n(w.depth.data() + c0, c1 - c0, s.old_surface.data() + c0);
  const Parameters& par = model.parameters;
  const Numbers n{static_cast<float>(dt) / static_cast<float>(parts), dx, static_cast<float>(gravity),
                  static_cast<float>(0.5 * (par.water_viscosity + par.blood_viscosity) / par.density)};
  const Direction along{columns, rows, 1, cells, 1, cells + 1, 1, cells};
  const Direction up{rows, columns, cells, 1, cells, 1, cells + 1, 1};
  for (int part = 0; part < parts; ++part) {
    faces(w, along, w.u, w.v, n, first, last, 0, columns, s.face_u, s.new_u);
    faces(w, up, w.v, w.u, n, 0, columns - 1, first, last + 1, s.face_v, s.new_v);
    const std::size_t u0 = static_cast<std::size_t>(first) * (cells + 1),
                      u1 = static_cast<std::size_t>(last + 1) * (cells + 1);
    std::copy_n(s.new_u.data() + u0, u1 - u0, w.u.data() + u0);
    std::copy_n(s.new_v.data() + c0, c1 + cells - c0, w.v.data() + c0);
    // Flux with the depth upwind of the new velocity; no cell gives more than it has.
    for (int r = first; r <= last; ++r) {
      for (int c = 0; c <= columns; ++c) {
        const std::size_t f = static_cast<std::size_t>(r) * (cells + 1) + c;
        float drop;
        const std::size_t j = static_cast<std::size_t>(r) * cells + c;
        s.face_u[f] = c == 0 || c == columns ? 0.0f : w.u[f] * faceDepth(w, j - 1, j, w.u[f], drop);
      }
    }
    for (int r = first; r <= last + 1; ++r) {
      for (int c = 0; c < columns; ++c) {
        const std::size_t j = static_cast<std::size_t>(r) * cells + c;
        float drop;
        s.face_v[j] = r == first || r == last + 1 ? 0.0f : w.v[j] * faceDepth(w, j - cells, j, w.v[j], drop);
      }
    }
    const float ratio = n.dt / n.dx;
    for (int r = first; r <= last; ++r) {
      for (int c = 0; c < columns; ++c) {
        const std::size_t i = static_cast<std::size_t>(r) * cells + c, f = i + static_cast<std::size_t>(r);
        const float out = std::max(0.0f, -s.face_u[f]) + std::max(0.0f, s.face_u[f + 1]) +
                          std::max(0.0f, -s.face_v[i]) + std::max(0.0f, s.face_v[i + cells]);
        const float give = ratio * out;
        s.share[i] = give > w.depth[i] ? w.depth[i] / give : 1.0f;
      }
    }
    const auto limited = [&](float q, std::size_t from, std::size_t to) {
      return q * s.share[q > 0 ? from : to];
    };
    // Blood goes with the water of the cell that it comes from.
    const auto fraction = [&](std::size_t i) {
      return w.depth[i] > 0 ? std::min(1.0f, w.blood[i] / w.depth[i]) : 0.0f;
    };
    for (int r = first; r <= last; ++r) {
      for (int c = 1; c < columns; ++c) {
        const std::size_t i = static_cast<std::size_t>(r) * cells + c, f = i + static_cast<std::size_t>(r);
        s.face_u[f] = limited(s.face_u[f], i - 1, i);
        s.new_u[f] = s.face_u[f] * fraction(s.face_u[f] > 0 ? i - 1 : i);
      }
      s.new_u[static_cast<std::size_t>(r) * (cells + 1)] =
          s.new_u[static_cast<std::size_t>(r) * (cells + 1) + cells] = 0;
    }
    for (int r = first; r <= last + 1; ++r) {
      for (int c = 0; c < columns; ++c) {
        const std::size_t i = static_cast<std::size_t>(r) * cells + c;
        if (r == first || r == last + 1) {
          s.new_v[i] = 0;
          continue;
        }
        s.face_v[i] = limited(s.face_v[i], i - cells, i);
        s.new_v[i] = s.face_v[i] * fraction(s.face_v[i] > 0 ? i - cells : i);
      }
    }
    for (int r = first; r <= last; ++r) {
      for (int c = 0; c < columns; ++c) {
        const std::size_t i = static_cast<std::size_t>(r) * cells + c, f = i + static_cast<std::size_t>(r);
        const float change = ratio * (s.face_u[f] - s.face_u[f + 1] + s.face_v[i] - s.face_v[i + cells]);
        const float blood = ratio * (s.new_u[f] - s.new_u[f + 1] + s.new_v[i] - s.new_v[i + cells]);
        w.depth[i] = std::max(0.0f, w.depth[i] + change);
        w.blood[i] = std::clamp(w.blood[i] + blood, 0.0f, w.depth[i]);
      }
    }
  }
  const float inverse_dt = static_cast<float>(1.0 / dt);
  for (std::size_t i = c0; i < c1; ++i) w.rise[i] = (w.depth[i] - s.old_surface[i]) * inverse_dt;
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
