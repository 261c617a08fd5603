#include <algorithm>
#include <cmath>

#include "scratch.h"

namespace vest::fluid {
namespace {

constexpr float kGround = 1e-3f;  ///< m: as far as contacts let tissue into the ground (assumed)
constexpr float kSame = 1e-4f;    ///< m: nearer to the highest face is the highest face (tuned)
/// m: ground that is so much higher than at the last look has come from the side, not from below (assumed: 30
/// mm/s).
constexpr float kOver = 1.5e-3f;
constexpr std::size_t kOpen = 6;  ///< places that liquid set aside is shared among (tuned)
/// m: what is this high over the level may dip in before the next look, at some 0.2 m/s (assumed).
constexpr float kDips = 0.01f;
/// Horizontal over vertical part of a face's pressure: what stands steeper than 72° is hardly seen by cells
/// of millimetres (assumed).
constexpr float kSteepest = 3.0f;

/// A triangle from above, counter-clockwise there. `up`: its outside faces up.
struct Seen {
  const float *a, *b, *c;  ///< m
  std::array<std::uint32_t, 3> knots;
  float twice;  ///< m²: twice the area that it covers, > 0
  bool up;
};

/// @return false where the triangle is gone or stands upright
bool see(const Surface& surface, std::size_t t, Seen& seen) {
  if (surface.alive && !surface.alive[t]) return false;
  seen.knots = surface.triangles[t];
  if (std::max({seen.knots[0], seen.knots[1], seen.knots[2]}) >= surface.knot_count) return false;
  seen.a = surface.positions + 3 * seen.knots[0], seen.b = surface.positions + 3 * seen.knots[1],
  seen.c = surface.positions + 3 * seen.knots[2];
  seen.twice =
      (seen.b[0] - seen.a[0]) * (seen.c[1] - seen.a[1]) - (seen.b[1] - seen.a[1]) * (seen.c[0] - seen.a[0]);
  seen.up = seen.twice > 0;
  if (!seen.up) {
    std::swap(seen.b, seen.c), std::swap(seen.knots[1], seen.knots[2]);
    seen.twice = -seen.twice;
  }
  return seen.twice > 1e-10f;
}

/// Whether a place on the edge p … q belongs to the triangle on its left: of two that share it, to one.
inline bool ownsEdge(const float* p, const float* q) {
  return q[1] > p[1] || (q[1] == p[1] && q[0] < p[0]);
}

/// What a triangle covers of a cell: its middle.
struct Hit {
  std::size_t cell;
  float w[3], sum;  ///< weights of the corners times their sum
  float z;          ///< m
  bool own;         ///< of triangles side by side one alone has the place, also on their edges
};

/// Calls f(Hit) for each cell whose middle lies in the triangle, or next to its edge.
template <class F>
void eachCell(const Model& model, const Seen& t, F&& f) {
  const float cell = static_cast<float>(model.parameters.pool_cell), inverse = 1.0f / cell,
              x0 = static_cast<float>(model.parameters.low[0]),
              y0 = static_cast<float>(model.parameters.low[1]);
  const float *a = t.a, *b = t.b, *c = t.c;
  const auto first = [&](float low, float from) {
    return std::max(0, CellGrid::floorInt((low - from) * inverse - 0.5f));
  };
  const auto last = [&](float high, float from, int count) {
    return std::min(count - 1, CellGrid::floorInt((high - from) * inverse - 0.5f) + 1);
  };
  const int c0 = first(std::min({a[0], b[0], c[0]}), x0),
            c1 = last(std::max({a[0], b[0], c[0]}), x0, model.columns),
            r0 = first(std::min({a[1], b[1], c[1]}), y0),
            r1 = last(std::max({a[1], b[1], c[1]}), y0, model.rows);
  const float slack = -1e-4f * t.twice;
  for (int r = r0; r <= r1; ++r) {
    for (int col = c0; col <= c1; ++col) {
      const float px = x0 + (static_cast<float>(col) + 0.5f) * cell,
                  py = y0 + (static_cast<float>(r) + 0.5f) * cell;
      const float wa = (b[0] - px) * (c[1] - py) - (b[1] - py) * (c[0] - px);
      const float wb = (c[0] - px) * (a[1] - py) - (c[1] - py) * (a[0] - px);
      const float wc = (a[0] - px) * (b[1] - py) - (a[1] - py) * (b[0] - px);
      if (wa < slack || wb < slack || wc < slack) continue;
      const float sum = wa + wb + wc;
      const bool own = (wa > 0 || (wa == 0 && ownsEdge(b, c))) && (wb > 0 || (wb == 0 && ownsEdge(c, a))) &&
                       (wc > 0 || (wc == 0 && ownsEdge(a, b)));
      f(Hit{static_cast<std::size_t>(r) * static_cast<std::size_t>(model.columns) +
                static_cast<std::size_t>(col),
            {wa, wb, wc},
            sum,
            (wa * a[2] + wb * b[2] + wc * c[2]) / sum,
            own});
    }
  }
}

/// The highest upward face over each cell, of the surfaces that f chooses.
template <class Choice>
void highest(const Model& model, const Inputs& inputs, const ScratchData& s, std::vector<float>& bed,
             std::vector<std::int32_t>& triangle, Choice&& chosen) {
  for (std::size_t k = 0; k < inputs.surface_count; ++k) {
    const Surface& surface = inputs.surfaces[k];
    if (!chosen(surface)) continue;
    for (std::size_t t = 0; t < surface.triangle_count; ++t) {
      Seen seen;
      if (!see(surface, t, seen) || !seen.up) continue;
      const auto id = static_cast<std::int32_t>(s.triangle_offset[k] + t);
      eachCell(model, seen, [&](const Hit& hit) {
        if (hit.z > bed[hit.cell]) bed[hit.cell] = hit.z, triangle[hit.cell] = id;
      });
    }
  }
}

/// Where water that stands on rigid ground reaches under tissue: to the lowest level beside it, as in
/// communicating vessels. ScratchData::around: per cell the open cell that it comes from, or -1.
void reachUnder(const Model& model, const Pools& w, ScratchData& s) {
  std::fill(s.around.begin(), s.around.end(), -1);
  s.open.clear();
  for (std::size_t i = 0; i < w.depth.size(); ++i)
    if (w.depth[i] >= kStanding && s.floor[i] > kNoBed && w.bed[i] <= s.floor[i])
      s.open.push_back(static_cast<std::int32_t>(i));
  const auto level = [&](std::int32_t i) {
    return w.bed[static_cast<std::size_t>(i)] + w.depth[static_cast<std::size_t>(i)];
  };
  std::sort(s.open.begin(), s.open.end(), [&](std::int32_t a, std::int32_t b) {
    return level(a) != level(b) ? level(a) < level(b) : a < b;
  });
  for (const std::int32_t from : s.open) {
    const float top = level(from);
    s.wave.clear();
    s.wave.push_back(from);
    for (std::size_t k = 0; k < s.wave.size(); ++k) {
      const std::int32_t i = s.wave[k], c = i % model.columns, r = i / model.columns;
      const std::int32_t beside[] = {c > 0 ? i - 1 : -1, c + 1 < model.columns ? i + 1 : -1,
                                     r > 0 ? i - model.columns : -1,
                                     r + 1 < model.rows ? i + model.columns : -1};
      for (const std::int32_t j : beside) {
        if (j < 0) continue;
        const auto at = static_cast<std::size_t>(j);
        if (s.around[at] >= 0 || !(s.floor[at] > kNoBed) || !(s.floor[at] < top) ||
            !(w.bed[at] > s.floor[at]))
          continue;
        s.around[at] = from;
        s.wave.push_back(j);
      }
    }
  }
}

/// What tissue comes over it does not lift: liquid that lies below the tissue goes to the nearest places that
/// are open, up to kOpen of them. @param bed the new one
void setAside(const Model& model, const std::vector<float>& bed, Pools& w, ScratchData& s) {
  std::fill(s.around.begin(), s.around.end(), -1);  // cells that the search from this one has seen
  const auto n = static_cast<std::int32_t>(w.depth.size());
  for (std::int32_t from = 0; from < n; ++from) {
    const auto i = static_cast<std::size_t>(from);
    if (!(w.depth[i] > 0) || !(w.bed[i] > kNoBed) || !(bed[i] - w.bed[i] > kOver)) continue;
    const float level = w.bed[i] + w.depth[i];
    if (!(bed[i] > level)) continue;
    std::array<std::size_t, kOpen> open{};
    std::size_t found = 0;
    s.wave.clear();
    s.wave.push_back(from);
    s.around[i] = from;
    for (std::size_t k = 0; k < s.wave.size() && found < kOpen; ++k) {
      const std::int32_t at = s.wave[k], c = at % model.columns, r = at / model.columns;
      const std::int32_t beside[] = {c > 0 ? at - 1 : -1, c + 1 < model.columns ? at + 1 : -1,
                                     r > 0 ? at - model.columns : -1,
                                     r + 1 < model.rows ? at + model.columns : -1};
      for (const std::int32_t j : beside) {
        const auto next = static_cast<std::size_t>(std::max(0, j));
        if (j < 0 || s.around[next] == from) continue;
        s.around[next] = from;
        const bool is_open =
            bed[next] > kNoBed && bed[next]<level, below = s.floor[next]> kNoBed && s.floor[next] < level;
        if (is_open && found < kOpen) open[found++] = next;
        if (!is_open && below) s.wave.push_back(j);
      }
    }
    if (found == 0) continue;  // all is covered: it stays where it is drawn
    const float share = 1.0f / static_cast<float>(found);
    for (std::size_t k = 0; k < found; ++k)
      w.depth[open[k]] += share * w.depth[i], w.blood[open[k]] += share * w.blood[i];
    w.depth[i] = w.blood[i] = 0;
  }
}

/// Where water reaches under tissue: how high it may stand there, ScratchData::underside.
void findUndersides(const Model& model, const Inputs& inputs, const Pools& w, ScratchData& s) {
  std::copy(w.bed.begin(), w.bed.end(), s.underside.begin());
  for (std::size_t k = 0; k < inputs.surface_count; ++k) {
    const Surface& surface = inputs.surfaces[k];
    if (surface.rigid) continue;
    for (std::size_t t = 0; t < surface.triangle_count; ++t) {
      Seen seen;
      if (!see(surface, t, seen) || (surface.closed && seen.up)) continue;
      eachCell(model, seen, [&](const Hit& hit) {
        if (s.around[hit.cell] >= 0) s.underside[hit.cell] = std::min(s.underside[hit.cell], hit.z);
      });
    }
  }
}

}  // namespace

void renewBed(const Model& model, const Inputs& inputs, State& state, ScratchData& s) {
  Pools& w = state.pools;
  // Rigid ground that lies still was looked at before.
  bool still = s.has_floor;
  for (std::size_t k = 0; k < inputs.surface_count; ++k)
    still &= !inputs.surfaces[k].rigid || inputs.surfaces[k].still;
  if (!still) {
    std::fill(s.floor.begin(), s.floor.end(), kNoBed);
    std::fill(s.floor_triangle.begin(), s.floor_triangle.end(), -1);
    highest(model, inputs, s, s.floor, s.floor_triangle, [](const Surface& f) { return f.rigid; });
    s.has_floor = true;
  }
  auto& bed = s.old_surface;  // scratch of the same size or larger
  std::copy(s.floor.begin(), s.floor.end(), bed.begin());
  std::copy(s.floor_triangle.begin(), s.floor_triangle.end(), w.bed_triangle.begin());
  highest(model, inputs, s, bed, w.bed_triangle, [](const Surface& f) { return !f.rigid; });
  setAside(model, bed, w, s);
  // Where tissue went away from under a pool the old bed holds, and nothing bears what stands there.
  for (std::size_t i = 0; i < w.bed.size(); ++i)
    if (bed[i] > kNoBed) w.bed[i] = bed[i];
}

void weighPools(const Model& model, const Inputs& inputs, State& state, ScratchData& s, Report& report) {
  const Pools& w = state.pools;
  const Parameters& par = model.parameters;
  const double gravity = std::max(0.0, -inputs.gravity[2]), area = par.pool_cell * par.pool_cell;
  const auto weight = [&](std::size_t i, float depth) {  // N: of so much of the liquid that stands in a cell
    const double blood = w.depth[i] > 0 ? static_cast<double>(w.blood[i] / w.depth[i]) : 0.0;
    return gravity * area * (par.density + (par.blood_density - par.density) * blood) *
           static_cast<double>(depth);
  };
  const auto impedance = [&](float depth) {  // N·s/m of a cell
    return par.density * area * std::sqrt(gravity * static_cast<double>(depth));
  };
  reachUnder(model, w, s);
  if (std::any_of(s.around.begin(), s.around.end(), [](std::int32_t from) { return from >= 0; }))
    findUndersides(model, inputs, w, s);
  sinkLevels(model, state, s);
  const auto sunk = [&](std::size_t node) { return std::max(0.0f, w.sunk[node]); };
  for (std::size_t k = 0; k < inputs.surface_count; ++k) {
    const Surface& surface = inputs.surfaces[k];
    if (surface.rigid) continue;
    s.loaded.clear();
    for (std::size_t t = 0; t < surface.triangle_count; ++t) {
      Seen seen;
      if (!see(surface, t, seen)) continue;
      const auto id = static_cast<std::int32_t>(s.triangle_offset[k] + t);
      // Pressure acts along the normal: what is vertical of it is the weight of the column.
      const float e0[3] = {seen.b[0] - seen.a[0], seen.b[1] - seen.a[1], seen.b[2] - seen.a[2]},
                  e1[3] = {seen.c[0] - seen.a[0], seen.c[1] - seen.a[1], seen.c[2] - seen.a[2]};
      float x = (e0[1] * e1[2] - e0[2] * e1[1]) / seen.twice,
            y = (e0[2] * e1[0] - e0[0] * e1[2]) / seen.twice;
      const float steep = std::sqrt(x * x + y * y);
      if (steep > kSteepest) x *= kSteepest / steep, y *= kSteepest / steep;
      eachCell(model, seen, [&](const Hit& hit) {
        const std::size_t i = hit.cell;
        if (s.around[i] < 0 && !(w.depth[i] > kDryDepth)) return;
        const std::int32_t from = s.around[i];
        const auto source = static_cast<std::size_t>(std::max(0, from));
        // What lies in the ground, as vessels in the wall, has no water about it.
        const float buried = std::min(1.0f, std::max(0.0f, 1.0f + (hit.z - s.floor[i]) / kGround));
        const float level = w.bed[source] + w.depth[source] - sunk(w.depth.size() + i),
                    under = from < 0 ? 0.0f : buried * (level - hit.z);
        double down = 0, drag = 0, stiffness = 0;
        if (under > 0 && !surface.closed) return;  // a sheet with water on both sides
        if (seen.up && w.bed_triangle[i] == id) {
          down = weight(i, w.depth[i] > kDryDepth ? std::max(0.0f, w.depth[i] - sunk(i)) : 0.0f);
          drag = impedance(w.depth[i]);
        } else if (under > 0 && hit.own && (!seen.up || hit.z < w.bed[i] - kSame)) {
          down = seen.up ? weight(source, under) : -weight(source, under);
          drag = impedance(under);
        }
        // What the level lifts follows the tissue at once (docs/decisions/0026-…), also where it dips in
        // anew.
        const bool lifts = from >= 0 && surface.closed && hit.own && w.bed_triangle[i] != id &&
                           under > -kDips && (!seen.up || hit.z < w.bed[i] - kSame);
        if (lifts) stiffness = (seen.up ? -1 : 1) * weight(source, buried);
        if (down == 0 && stiffness == 0) return;
        // Sideways still water pushes a closed organ by nothing in the sum, and squeezes it by less than what
        // fills it resists; by the middles of cells the sum would be any (docs/decisions/0026-…).
        const double aside = from >= 0 && surface.closed ? 0.0 : -down;
        const double force[5] = {aside * static_cast<double>(x), aside * static_cast<double>(y), -down, drag,
                                 stiffness};
        for (int corner = 0; corner < 3; ++corner) {
          const std::uint32_t knot = seen.knots[static_cast<std::size_t>(corner)];
          auto& to = s.knot_load[knot];
          if (!s.is_loaded[knot]) s.is_loaded[knot] = 1, s.loaded.push_back(knot);
          const double share = static_cast<double>(hit.w[corner] / hit.sum);
          for (std::size_t n = 0; n < 5; ++n) to[n] += share * force[n];
          if (!lifts) continue;
          const float z = surface.positions[3 * knot + 2];
          to[5] += share * static_cast<double>(level - z), to[6] += share;
        }
      });
    }
    std::sort(s.loaded.begin(), s.loaded.end());
    for (const std::uint32_t knot : s.loaded) {
      auto& from = s.knot_load[knot];
      report.loads.push_back(
          {static_cast<std::uint16_t>(k),
           knot,
           {static_cast<float>(from[0]), static_cast<float>(from[1]), static_cast<float>(from[2])},
           static_cast<float>(from[3]),
           static_cast<float>(from[4]),
           static_cast<float>(from[6] > 0 ? from[5] / from[6] : 0.0)});
      from = {};
      s.is_loaded[knot] = 0;
    }
  }
}

}  // namespace vest::fluid
