#include <algorithm>
#include <array>
#include <cmath>

#include "scratch.h"

namespace vest::fluid {
namespace {

constexpr float kWeighs = 5e-4f;  ///< m: thinner films weigh less than 5 Pa and are left out (ours)
constexpr int kPatch = 4;         ///< cells: the weight over a patch of so many rests on one triangle (ours)
constexpr std::size_t kRun = 8;   ///< triangles of a run, whose uplift acts on one of them (ours)
constexpr float kUnder = 0.003f;  ///< m below the bed: a triangle lies under other tissue (ours)

struct Corners {
  const float *a, *b, *c;
};

/// What rests on one triangle in the end: the vertical force of several, at the strongest of them.
struct Load {
  std::size_t surface = 0;
  std::uint32_t id = 0;
  double force = 0, strongest = 0;  ///< N upwards; N
  float weights[3] = {1.0f / 3, 1.0f / 3, 1.0f / 3};
};

void pass(ScratchData& s, const Load& load, double dt) {
  if (load.force == 0) return;
  PlacedTriangle t{};
  t.id = load.id;
  addMomentum(s, t, load.weights, 0.0, 0.0, load.force * dt);
}

/// Weights of a place in a triangle seen from above.
void weightsAt(const Corners& t, float x, float y, float weights[3]) {
  const float wa = (t.b[0] - x) * (t.c[1] - y) - (t.b[1] - y) * (t.c[0] - x),
              wb = (t.c[0] - x) * (t.a[1] - y) - (t.c[1] - y) * (t.a[0] - x),
              wc = (t.a[0] - x) * (t.b[1] - y) - (t.a[1] - y) * (t.b[0] - x);
  const float a = std::max(0.0f, wa), b = std::max(0.0f, wb), c = std::max(0.0f, wc), sum = a + b + c;
  if (!(sum > 0)) return;
  weights[0] = a / sum, weights[1] = b / sum, weights[2] = c / sum;
}

/// Weight of what stands over the bed.
void weigh(const Model& model, const Inputs& inputs, const State& state, ScratchData& s) {
  const Pools& w = state.pools;
  const Parameters& par = model.parameters;
  const double unit = -inputs.gravity[2] * par.pool_cell * par.pool_cell;
  std::array<Load, kPatch * kPatch> loads;
  for (int r0 = 0; r0 < model.rows; r0 += kPatch) {
    for (int c0 = 0; c0 < model.columns; c0 += kPatch) {
      std::size_t count = 0;
      for (int r = r0; r < std::min(model.rows, r0 + kPatch); ++r) {
        for (int c = c0; c < std::min(model.columns, c0 + kPatch); ++c) {
          const std::size_t i = static_cast<std::size_t>(r) * model.columns + c;
          if (!(w.depth[i] > kWeighs) || w.bed_triangle[i] < 0) continue;
          const auto id = static_cast<std::uint32_t>(w.bed_triangle[i]);
          const std::size_t surface = surfaceOf(model, s, id);
          const Surface& tissue = inputs.surfaces[surface];
          const std::uint32_t triangle = id - s.triangle_offset[surface];
          if (surface >= inputs.surface_count || triangle >= tissue.triangle_count) continue;
          const auto& n = tissue.triangles[triangle];
          if (std::max({n[0], n[1], n[2]}) >= tissue.knot_count) continue;
          std::size_t k = 0;
          while (k < count && loads[k].surface != surface) ++k;
          if (k == count) loads[count++] = Load{}, loads[k].surface = surface;
          Load& load = loads[k];
          const auto depth = static_cast<double>(w.depth[i]), blood = static_cast<double>(w.blood[i]);
          const double force = unit * (par.density * depth + (par.blood_density - par.density) * blood);
          load.force -= force;
          if (force <= load.strongest) continue;
          load.strongest = force, load.id = id;
          const Corners corners{tissue.positions + 3 * n[0], tissue.positions + 3 * n[1],
                                tissue.positions + 3 * n[2]};
          weightsAt(corners, static_cast<float>(par.low[0] + (c + 0.5) * par.pool_cell),
                    static_cast<float>(par.low[1] + (r + 0.5) * par.pool_cell), load.weights);
        }
      }
      for (std::size_t k = 0; k < count; ++k) pass(s, loads[k], inputs.dt);
    }
  }
}

/// Tissue that lies under other tissue is wetted from the side: by the water that stands beside it, to its
/// height.
void lift(const Model& model, const Inputs& inputs, const State& state, ScratchData& s, float highest) {
  const Pools& w = state.pools;
  const Parameters& par = model.parameters;
  const double unit = -inputs.gravity[2] * par.density;
  for (std::size_t k = 0; k < inputs.surface_count; ++k) {
    const Surface& tissue = inputs.surfaces[k];
    Load load;
    for (std::size_t t = 0; t < tissue.triangle_count; ++t) {
      if (t % kRun == 0) pass(s, load, inputs.dt), load = Load{};
      if (tissue.alive && !tissue.alive[t]) continue;
      const auto& n = tissue.triangles[t];
      if (std::max({n[0], n[1], n[2]}) >= tissue.knot_count) continue;
      const Corners q{tissue.positions + 3 * n[0], tissue.positions + 3 * n[1], tissue.positions + 3 * n[2]};
      const float z = (q.a[2] + q.b[2] + q.c[2]) / 3;
      if (!(z < highest)) continue;
      const int c = columnOf(model, (q.a[0] + q.b[0] + q.c[0]) / 3),
                r = rowOf(model, (q.a[1] + q.b[1] + q.c[1]) / 3);
      if (c < 0 || r < 0 || c >= model.columns || r >= model.rows) continue;
      if (!(z < w.bed[static_cast<std::size_t>(r) * model.columns + c] - kUnder)) continue;
      const std::size_t beside = nearestOpenCell(model, w, c, r, -1e2f, z, 8);
      if (beside >= w.bed.size() || !(w.depth[beside] > kWeighs)) continue;
      const float head = w.bed[beside] + w.depth[beside] - z;
      if (!(head > 0)) continue;
      const double twice = (q.b[0] - q.a[0]) * (q.c[1] - q.a[1]) - (q.b[1] - q.a[1]) * (q.c[0] - q.a[0]);
      const double force = -0.5 * twice * unit * static_cast<double>(head);  // up where it faces down
      load.force += force;
      if (std::fabs(force) <= load.strongest) continue;
      load.strongest = std::fabs(force);
      load.id = s.triangle_offset[k] + static_cast<std::uint32_t>(t);
    }
    pass(s, load, inputs.dt);
  }
}

}  // namespace

void pressPools(const Model& model, const Inputs& inputs, const State& state, ScratchData& s) {
  const Pools& w = state.pools;
  if (!(inputs.gravity[2] < 0)) return;
  float highest = kNoBed;
  for (std::size_t i = 0; i < w.depth.size(); ++i)
    if (w.depth[i] > kWeighs && w.bed[i] > kNoBed) highest = std::max(highest, w.bed[i] + w.depth[i]);
  if (!(highest > kNoBed)) return;
  weigh(model, inputs, state, s);
  lift(model, inputs, state, s, highest);
}

}  // namespace vest::fluid
