#include <algorithm>
#include <cmath>

#include "scratch.h"

namespace vest::fluid {
namespace {

constexpr float kGround = 1e-3f;  ///< m: as far as contacts let tissue into the ground (assumed)
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

/// A cell whose middle a triangle covers.
struct Hit {
  std::size_t cell;
  float z;  ///< m, of the triangle there
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
      f(Hit{static_cast<std::size_t>(r) * static_cast<std::size_t>(model.columns) +
                static_cast<std::size_t>(col),
            (wa * a[2] + wb * b[2] + wc * c[2]) / sum});
    }
  }
}

/// What a triangle covers of a cell.
struct Overlap {
  std::size_t cell;
  double share;  ///< of the cell's area, > 0
  double w[3];   ///< weights of the corners at its middle
  float z;       ///< m, there
};

/// Cuts a polygon (cells, x y) at a line x = at or y = at; keeps what lies above (sign 1) or below (-1).
struct Polygon {
  static constexpr int kMost = 12;  // four lines make seven of three; rounding hardly more
  double places[2][kMost][2];       // a cut goes from one to the other
  double (*at)[2] = places[0];
  int count = 3;

  explicit Polygon(const double (&triangle)[3][2]) {
    for (int k = 0; k < 3; ++k) at[k][0] = triangle[k][0], at[k][1] = triangle[k][1];
  }
  Polygon(const Polygon&) = delete;
  Polygon& operator=(const Polygon&) = delete;

  void cut(int axis, double line, double sign) {
    int n = 0, above = 0;
    for (int k = 0; k < count; ++k) above += sign * (at[k][axis] - line) >= 0 ? 1 : 0;
    if (above == count && count + 2 <= kMost) return;  // nothing is cut off
    if (above == 0) {
      count = 0;
      return;
    }
    double(*const out)[2] = at == places[0] ? places[1] : places[0];
    for (int k = 0; k < count && n + 2 <= kMost; ++k) {
      const double *p = at[k], *q = at[k + 1 < count ? k + 1 : 0];
      const double a = sign * (p[axis] - line), b = sign * (q[axis] - line);
      if (a >= 0) out[n][0] = p[0], out[n++][1] = p[1];
      if ((a > 0 && b < 0) || (a < 0 && b > 0)) {
        const double part = a / (a - b);
        out[n][axis] = line, out[n][1 - axis] = p[1 - axis] + part * (q[1 - axis] - p[1 - axis]);
        ++n;
      }
    }
    count = n;
    at = out;
  }
};

/// Calls f(Overlap) for each cell that the triangle covers a part of, where wanted(cell). By areas, not by
/// the cells' middles: what passes to a knot goes smoothly from cell to cell as it moves (0025).
template <class W, class F>
void eachOverlap(const Model& model, const Seen& t, W&& wanted, F&& f) {
  const double inverse = 1.0 / model.parameters.pool_cell;
  double p[3][2];  // cells
  const float* corner[3] = {t.a, t.b, t.c};
  for (int k = 0; k < 3; ++k)
    for (int axis = 0; axis < 2; ++axis)
      p[k][axis] = (static_cast<double>(corner[k][axis]) - model.parameters.low[axis]) * inverse;
  const auto first = [&](int axis) {
    return std::max(0.0, std::floor(std::min({p[0][axis], p[1][axis], p[2][axis]})));
  };
  const auto last = [&](int axis, int count) {
    return std::min<double>(count - 1, std::floor(std::max({p[0][axis], p[1][axis], p[2][axis]})));
  };
  const double c1 = last(0, model.columns), r1 = last(1, model.rows);
  const double whole = (p[1][0] - p[0][0]) * (p[2][1] - p[0][1]) - (p[1][1] - p[0][1]) * (p[2][0] - p[0][0]);
  for (double r = first(1); r <= r1; ++r) {
    for (double c = first(0); c <= c1; ++c) {
      const std::size_t cell =
          static_cast<std::size_t>(r) * static_cast<std::size_t>(model.columns) + static_cast<std::size_t>(c);
      if (!wanted(cell)) continue;
      Polygon g(p);
      g.cut(0, c, 1), g.cut(0, c + 1, -1), g.cut(1, r, 1), g.cut(1, r + 1, -1);
      double twice = 0, x = 0, y = 0;  // against the first corner, or they would cancel
      for (int k = 1; k + 1 < g.count; ++k) {
        const double ux = g.at[k][0] - g.at[0][0], uy = g.at[k][1] - g.at[0][1],
                     vx = g.at[k + 1][0] - g.at[0][0], vy = g.at[k + 1][1] - g.at[0][1];
        const double part = ux * vy - uy * vx;
        twice += part, x += part * (ux + vx), y += part * (uy + vy);
      }
      if (!(twice > 1e-9)) continue;
      x = g.at[0][0] + x / (3 * twice), y = g.at[0][1] + y / (3 * twice);
      Overlap o{cell, 0.5 * twice, {}, 0};
      for (int k = 0; k < 3; ++k) {
        const double *m = p[(k + 1) % 3], *n = p[(k + 2) % 3];
        o.w[k] = std::clamp(((m[0] - x) * (n[1] - y) - (m[1] - y) * (n[0] - x)) / whole, 0.0, 1.0);
      }
      o.z = static_cast<float>(o.w[0] * static_cast<double>(t.a[2]) + o.w[1] * static_cast<double>(t.b[2]) +
                               o.w[2] * static_cast<double>(t.c[2]));
      f(o);
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
  const auto level = [&](std::int32_t i) { return w.top(static_cast<std::size_t>(i)); };
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
    const float level = w.top(i);
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

/// 0 … 1: how far a face is what the liquid of its cell stands on: within a cell's width above or below the
/// bed it is (steep ground), two widths away not (assumed).
double nearBed(const Model& model, const Pools& w, const Overlap& part) {
  const double off = std::fabs(static_cast<double>(part.z - w.bed[part.cell]));
  return std::clamp(2.0 - off / model.parameters.pool_cell, 0.0, 1.0);
}

/// ScratchData::bearing: share of each cell's area with faces that its liquid stands on; over 1 where they
/// overlap.
template <class W>
void findBearing(const Model& model, const Inputs& inputs, const Pools& w, ScratchData& s, W&& borne) {
  std::fill(s.bearing.begin(), s.bearing.end(), 0.0f);
  for (std::size_t k = 0; k < inputs.surface_count; ++k) {
    const Surface& surface = inputs.surfaces[k];
    if (surface.rigid) continue;
    for (std::size_t t = 0; t < surface.triangle_count; ++t) {
      Seen seen;
      if (see(surface, t, seen) && seen.up)
        eachOverlap(model, seen, borne, [&](const Overlap& part) {
          s.bearing[part.cell] += static_cast<float>(part.share * nearBed(model, w, part));
        });
    }
  }
}

}  // namespace

void renewBed(const Model& model, const Inputs& inputs, State& state, ScratchData& s) {
  Pools& w = state.pools;
  if (!s.has_floor) {
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
  const auto wet = [&](std::size_t i) { return s.around[i] >= 0 || w.depth[i] > kDryDepth; };
  // Liquid stands on tissue in a cell, not on the ground.
  const auto borne = [&](std::size_t i) { return w.depth[i] > kDryDepth && w.bed[i] > s.floor[i]; };
  findBearing(model, inputs, w, s, borne);
  for (std::size_t k = 0; k < inputs.surface_count; ++k) {
    const Surface& surface = inputs.surfaces[k];
    if (surface.rigid) continue;
    s.loaded.clear();
    for (std::size_t t = 0; t < surface.triangle_count; ++t) {
      Seen seen;
      if (!see(surface, t, seen)) continue;
      // Pressure acts along the normal: what is vertical of it is the weight of the column.
      float x = 0, y = 0;
      bool leans = false;
      const auto lean = [&] {
        const float e0[3] = {seen.b[0] - seen.a[0], seen.b[1] - seen.a[1], seen.b[2] - seen.a[2]},
                    e1[3] = {seen.c[0] - seen.a[0], seen.c[1] - seen.a[1], seen.c[2] - seen.a[2]};
        x = (e0[1] * e1[2] - e0[2] * e1[1]) / seen.twice, y = (e0[2] * e1[0] - e0[0] * e1[2]) / seen.twice;
        const float steep = std::sqrt(x * x + y * y);
        if (steep > kSteepest) x *= kSteepest / steep, y *= kSteepest / steep;
        leans = true;
      };
      eachOverlap(model, seen, wet, [&](const Overlap& part) {
        const std::size_t i = part.cell;
        // The liquid beside it: what reaches under it, or what stands in the cell itself.
        const bool open = s.around[i] < 0 && w.depth[i] >= kStanding && s.floor[i] > kNoBed && !borne(i);
        const std::size_t source = open ? i : static_cast<std::size_t>(std::max(0, s.around[i]));
        const bool beside = open || s.around[i] >= 0;
        // What lies in the ground, as vessels in the wall, has no water about it.
        const float buried = std::min(1.0f, std::max(0.0f, 1.0f + (part.z - s.floor[i]) / kGround));
        const float level = w.top(source) - sunk(open ? i : w.depth.size() + i),
                    under = beside ? buried * (level - part.z) : 0.0f;
        double down = 0, drag = 0, stiffness = 0;
        bool lifts = false;
        if (surface.closed && (under > 0 || (beside && under > -kDips && !seen.up))) {
          // What the level lifts follows the tissue at once (docs/decisions/0025-…), also where it dips in
          // anew.
          const double sign = part.share * (seen.up ? 1 : -1), depth = std::max(0.0f, under);
          lifts = true;
          down = sign * weight(source, 1) * depth, stiffness = -sign * weight(source, buried);
          drag = part.share * impedance(std::max(0.0f, under));
        } else if (seen.up && borne(i)) {
          // Under a sheet stands what is beside it: with water on both sides nothing weighs.
          const float below = beside ? w.top(source) - part.z : 0.0f,
                      rest = w.top(i) - w.bed[i] - (surface.closed ? sunk(i) : std::max(0.0f, below)),
                      head = rest > kDryDepth ? rest : 0.0f;
          const double share = part.share * nearBed(model, w, part) / std::max(1.0f, s.bearing[i]);
          down = share * weight(i, head), drag = share * impedance(w.depth[i]);
        }
        if (down == 0 && stiffness == 0) return;
        if (!leans) lean();
        // Sideways still water pushes a closed organ by nothing in the sum, and squeezes it by less than what
        // fills it resists; by cells the sum would be any (docs/decisions/0025-…).
        const double aside = beside && surface.closed ? 0.0 : -down;
        const double force[5] = {aside * static_cast<double>(x), aside * static_cast<double>(y), -down, drag,
                                 stiffness};
        for (int corner = 0; corner < 3; ++corner) {
          const std::uint32_t knot = seen.knots[static_cast<std::size_t>(corner)];
          auto& to = s.knot_load[knot];
          if (!s.is_loaded[knot]) s.is_loaded[knot] = 1, s.loaded.push_back(knot);
          const double share = part.w[corner];
          for (std::size_t n = 0; n < 5; ++n) to[n] += share * force[n];
          if (!lifts) continue;
          const float z = surface.positions[3 * knot + 2];
          to[5] += share * part.share * static_cast<double>(level - z), to[6] += share * part.share;
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
