#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "vest_effects/fluid/drawn_pools.h"

namespace vest::fluid {
namespace {

constexpr double kLeastPool = 1e-7, kFilm = 3e-4;  ///< m³, m: less is a wet surface, not a pool (tuned)
constexpr std::size_t kMostPools = 16;
constexpr int kSpan = 4;  ///< cells to either shore: 28 mm of organ with cells of 4 mm (tuned)

/// The largest connected pools that hold at least `least` m³ in cells deeper than `film` m.
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

/// Under the rim of an organ that hangs over a pool its surface goes on for kSpan cells, as far as it is
/// covered. It would end in one straight line along the rim, in sight of who looks under it. In what stands
/// on the floor nobody sees it.
void goUnder(const Model& model, const Pools& pools, std::vector<float>& surface,
             std::vector<std::uint32_t>& labels) {
  constexpr float kCliff = 0.008f;  ///< m over the level: no ground rises so within a cell (tuned)
  const auto columns = static_cast<std::size_t>(model.columns);
  std::vector<float> known;
  for (int ring = 0; ring < kSpan; ++ring) {
    known = surface;
    for (std::size_t i = 0; i < known.size(); ++i) {
      if (!std::isnan(known[i]) || pools.bed[i] <= kNoBed) continue;
      const std::size_t c = i % columns;
      const auto from = [&](bool inside, std::size_t j) {
        if (!inside || std::isnan(known[j]) || !(pools.bed[i] > known[j] + kCliff)) return;
        if (labels[i] != 0 && !(known[j] > surface[i]))
          return;  // of two the higher, whichever is looked at first
        surface[i] = known[j], labels[i] = labels[j];
      };
      from(c > 0, i - 1), from(c + 1 < columns, i + 1), from(i >= columns, i - columns),
          from(i + columns < known.size(), i + columns);
    }
  }
}

/// Under an organ that spans a pool water stands too, though the height field knows only the organ's top
/// there: the pool's surface goes on from shore to shore. Where tissue stands on the floor instead it hides
/// what is drawn within it. A cell that such an organ has just laid bare is a well there, into which the pool
/// falls within the next tenth of a second: its surface goes on, too.
/// @param surface m, world, per cell; NaN where it is dry  @param labels, patches grow with the surface
void bridge(const Model& model, const Pools& pools, std::vector<float>& surface,
            std::vector<std::uint32_t>& labels, std::vector<PoolPatch>& patches) {
  constexpr float kStep = 0.002f;  ///< m between the levels of two pools that are one below (tuned)
  constexpr int kWays[4][2] = {{1, 0}, {0, 1}, {1, 1}, {1, -1}};
  int c0 = model.columns, c1 = -1, r0 = model.rows, r1 = -1;
  for (const PoolPatch& p : patches) {
    c0 = std::min(c0, p.column), c1 = std::max(c1, p.column + p.columns - 1);
    r0 = std::min(r0, p.row), r1 = std::max(r1, p.row + p.rows - 1);
  }
  std::vector<float> known;
  // Which pools are one below, by their labels.
  std::uint32_t most = 0;
  for (const PoolPatch& p : patches) most = std::max(most, p.label);
  std::vector<std::uint32_t> same(most + 1);
  std::iota(same.begin(), same.end(), 0u);
  std::vector<std::uint8_t> drawn(most + 1);
  for (const PoolPatch& p : patches) drawn[p.label] = 1;
  const auto first = [&](std::uint32_t label) {
    while (same[label] != label) label = same[label];
    return label;
  };
  const auto cell = [&](int c, int r) {
    return static_cast<std::size_t>(r) * static_cast<std::size_t>(model.columns) +
           static_cast<std::size_t>(c);
  };
  const auto inside = [&](int c, int r) { return c >= c0 && r >= r0 && c <= c1 && r <= r1; };
  const auto wet = [&](int c, int r) { return inside(c, r) && !std::isnan(known[cell(c, r)]); };
  const auto beside = [&](int c, int r, float level) {  // tissue that rises above the water
    for (int dr = -1; dr <= 1; ++dr)
      for (int dc = -1; dc <= 1; ++dc)
        if (inside(c + dc, r + dr) && pools.bed[cell(c + dc, r + dr)] > level) return true;
    return false;
  };
  // Wells lie beside each other: those in the middle have their shores when the outer ones are drawn full.
  for (const bool wells : {false, true, true}) {
    known = surface;
    for (int r = r0; r <= r1; ++r) {
      for (int c = c0; c <= c1; ++c) {
        const std::size_t i = cell(c, r);
        if ((!wells && !std::isnan(known[i])) || pools.bed[i] <= kNoBed) continue;
        int span = 2 * kSpan + 1;
        for (const auto& way : kWays) {
          int a = 1, b = 1;
          while (a <= kSpan && !wet(c + a * way[0], r + a * way[1])) ++a;
          while (b <= kSpan && !wet(c - b * way[0], r - b * way[1])) ++b;
          if (a > kSpan || b > kSpan || a + b >= span) continue;
          const std::size_t p = cell(c + a * way[0], r + a * way[1]),
                            q = cell(c - b * way[0], r - b * way[1]);
          const float level = 0.5f * (known[p] + known[q]);
          if (std::fabs(known[p] - known[q]) > kStep) continue;
          const bool well = pools.bed[i] < level - kStep && !(known[i] >= level - kStep);
          if (wells ? !well || !beside(c, r, level) : level > pools.bed[i]) continue;
          surface[i] = level, labels[i] = labels[p], span = a + b;
          if (labels[p] > most || labels[q] > most || !drawn[labels[p]] || !drawn[labels[q]]) continue;
          const std::uint32_t one = first(labels[p]), other = first(labels[q]);
          same[std::max(one, other)] = std::min(one, other);
        }
      }
    }
  }
  goUnder(model, pools, surface, labels);
  // Drawn as one, or their shores would show where they meet.
  for (std::uint32_t& label : labels)
    if (label <= most) label = first(label);
  for (std::size_t k = 0; k < patches.size(); ++k) {
    PoolPatch& p = patches[k];
    if (first(p.label) == p.label) continue;
    const auto to = std::find_if(patches.begin(), patches.end(),
                                 [&](const PoolPatch& o) { return o.label == first(p.label); });
    if (to == patches.end()) continue;
    const int columns = std::max(to->column + to->columns, p.column + p.columns),
              rows = std::max(to->row + to->rows, p.row + p.rows);
    to->column = std::min(to->column, p.column), to->row = std::min(to->row, p.row);
    to->columns = columns - to->column, to->rows = rows - to->row;
    to->volume += p.volume, to->blood += p.blood;
    p.volume = 0;
  }
  patches.erase(
      std::remove_if(patches.begin(), patches.end(), [](const PoolPatch& p) { return !(p.volume > 0); }),
      patches.end());
  for (PoolPatch& p : patches) {
    int low_c = p.column, high_c = p.column + p.columns - 1, low_r = p.row, high_r = p.row + p.rows - 1;
    for (int r = std::max(r0, low_r - kSpan); r <= std::min(r1, p.row + p.rows - 1 + kSpan); ++r) {
      for (int c = std::max(c0, p.column - kSpan); c <= std::min(c1, p.column + p.columns - 1 + kSpan); ++c) {
        if (labels[cell(c, r)] != p.label) continue;
        low_c = std::min(low_c, c), high_c = std::max(high_c, c);
        low_r = std::min(low_r, r), high_r = std::max(high_r, r);
      }
    }
    p.column = low_c, p.columns = high_c - low_c + 1, p.row = low_r, p.rows = high_r - low_r + 1;
  }
}

/// A film on an organ that stands in a pool is none of its surface: thin water more than a cell above what is
/// beside it. Drawn with the pool it would be a cliff.
void leaveFilmsOut(const Model& model, const Pools& pools, std::vector<float>& surface,
                   std::vector<std::uint32_t>& labels) {
  constexpr float kThin = 0.004f;  ///< m (tuned)
  const std::vector<float> known = surface;
  const auto steep = static_cast<float>(model.parameters.pool_cell);
  const auto columns = static_cast<std::size_t>(model.columns), rows = static_cast<std::size_t>(model.rows);
  for (std::size_t i = 0; i < labels.size(); ++i) {
    if (labels[i] == 0 || pools.depth[i] > kThin) continue;
    const std::size_t c = i % columns, r = i / columns;
    const auto below = [&](bool inside, std::size_t j) {
      return inside && !std::isnan(known[j]) && known[j] < known[i] - steep;
    };
    if (below(c > 0, i - 1) || below(c + 1 < columns, i + 1) || below(r > 0, i - columns) ||
        below(r + 1 < rows, i + columns))
      surface[i] = std::numeric_limits<float>::quiet_NaN(), labels[i] = 0;
  }
}

}  // namespace

DrawnPools drawnPools(const Model& model, const State& state) {
  DrawnPools drawn;
  findPools(model, state, kLeastPool, kFilm, kMostPools, drawn.labels, drawn.patches);
  const Pools& w = state.pools;
  drawn.surface.assign(drawn.labels.size(), std::numeric_limits<float>::quiet_NaN());
  for (std::size_t i = 0; i < drawn.labels.size(); ++i)
    if (drawn.labels[i] != 0) drawn.surface[i] = w.top(i);
  leaveFilmsOut(model, w, drawn.surface, drawn.labels);
  bridge(model, w, drawn.surface, drawn.labels, drawn.patches);
  return drawn;
}

float drawnDepth(const Model& model, const Pools& pools, const DrawnPools& drawn, std::size_t cell) {
  const float known = drawn.surface[cell] - pools.bed[cell];
  if (!(known < 0)) return known;
  const auto columns = static_cast<std::size_t>(model.columns);
  const int column = static_cast<int>(cell % columns), row = static_cast<int>(cell / columns);
  float sum = 0;
  int found = 0;
  for (const auto& way : {std::pair{1, 0}, std::pair{-1, 0}, std::pair{0, 1}, std::pair{0, -1}})
    for (int k = 1; k <= kSpan; ++k) {
      const int c = column + k * way.first, r = row + k * way.second;
      if (c < 0 || r < 0 || c >= model.columns || r >= model.rows) break;
      const std::size_t i = static_cast<std::size_t>(r) * columns + static_cast<std::size_t>(c);
      if (drawn.labels[i] != drawn.labels[cell] || !(drawn.surface[i] > pools.bed[i])) continue;
      sum += drawn.surface[i] - pools.bed[i], ++found;
      break;
    }
  return found > 0 ? sum / static_cast<float>(found) : 1.0f;
}

}  // namespace vest::fluid
