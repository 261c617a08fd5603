#include <algorithm>
#include <cmath>

#include "scratch.h"

namespace vest::fluid {
namespace {

/// s: time in which liquid runs under tissue. A free film of h mm spreads over a length l like heat with
/// rho g h³/3 mu (lubrication): 0.1 s for water, 1 mm and 3 cm, 4 s for blood and half of that height
/// (assumed).
constexpr double kSeep = 2.0;
constexpr int kHalvings = 24;  ///< of the way between lowest ground and highest level: 1e-8 of it

/// Liquid at a cell: what stands there (node = cell), or what reaches under tissue (node = cells + cell).
struct Reaches {
  const Pools& w;
  const ScratchData& s;
  std::size_t cells;

  bool there(std::size_t node) const {
    return node < cells ? w.depth[node] >= kStanding && w.bed[node] > kNoBed : s.around[node - cells] >= 0;
  }
  float low(std::size_t node) const { return node < cells ? w.bed[node] : s.floor[node - cells]; }
  float top(std::size_t node) const {
    const auto from = node < cells ? node : static_cast<std::size_t>(s.around[node - cells]);
    return w.top(from);
  }
  /// Liquid at one is at the height of liquid at the other.
  bool meet(std::size_t a, std::size_t b) const { return low(a) < top(b) && low(b) < top(a); }
  /// m: gap under tissue below a level
  float gap(std::size_t node, float level) const {
    const float ground = low(node);
    return std::max(0.0f, std::min(level, s.underside[node - cells]) - ground);
  }
};

/// ScratchData::wave: all that communicates with a node.
void gather(const Model& model, const Reaches& all, std::size_t from, ScratchData& s) {
  const auto columns = static_cast<std::size_t>(model.columns), n = all.cells;
  s.wave.clear();
  s.wave.push_back(static_cast<std::int32_t>(from));
  s.sink[from] = 0;
  for (std::size_t k = 0; k < s.wave.size(); ++k) {
    const auto node = static_cast<std::size_t>(s.wave[k]), cell = node < n ? node : node - n;
    const auto look = [&](std::size_t beside) {
      for (const std::size_t next : {beside, n + beside}) {
        if (s.sink[next] >= 0 || !all.there(next) || !all.meet(node, next)) continue;
        s.sink[next] = 0;
        s.wave.push_back(static_cast<std::int32_t>(next));
      }
    };
    if (cell % columns > 0) look(cell - 1);
    if (cell % columns + 1 < columns) look(cell + 1);
    if (cell >= columns) look(cell - columns);
    if (cell + columns < n) look(cell + columns);
  }
}

/// m: the level at which what stands above it fills the gaps below it.
float commonLevel(const Pools& w, const Reaches& all, const ScratchData& s) {
  float low = 1e9f, high = -1e9f;
  for (const std::int32_t k : s.wave) {
    const auto node = static_cast<std::size_t>(k);
    low = std::min(low, all.low(node)), high = std::max(high, all.top(node));
  }
  const auto enough = [&](float level) {
    double rest = 0;  // m, summed over cells
    for (const std::int32_t k : s.wave) {
      const auto node = static_cast<std::size_t>(k);
      if (node < all.cells) {
        rest += static_cast<double>(std::min(w.depth[node], std::max(0.0f, all.top(node) - level)));
      } else {
        rest -= static_cast<double>(all.gap(node, level));
      }
    }
    return rest >= 0;
  };
  if (enough(high)) return high;
  for (int k = 0; k < kHalvings; ++k) {
    const float middle = 0.5f * (low + high);
    (enough(middle) ? low : high) = middle;
  }
  return low;
}

}  // namespace

void sinkLevels(const Model& model, State& state, ScratchData& s) {
  Pools& w = state.pools;
  const Reaches all{w, s, w.depth.size()};
  const double elapsed = std::max(0.0, state.time - w.sunk_at);
  const auto share = static_cast<float>(elapsed / (kSeep + elapsed));
  w.sunk_at = state.time;
  std::fill(s.sink.begin(), s.sink.end(), -1.0f);
  for (std::size_t i = 0; i < s.around.size(); ++i) {
    if (s.around[i] < 0 || s.sink[all.cells + i] >= 0) continue;
    gather(model, all, all.cells + i, s);
    const float level = commonLevel(w, all, s);
    for (const std::int32_t k : s.wave) {
      const auto node = static_cast<std::size_t>(k);
      s.sink[node] = std::max(0.0f, all.top(node) - level);
      if (node < all.cells) s.sink[node] = std::min(s.sink[node], w.depth[node]);
    }
  }
  // At once where liquid is new, then slowly: a gap that opens does not draw it faster than it can run there.
  for (std::size_t node = 0; node < s.sink.size(); ++node) {
    const float to = s.sink[node];
    w.sunk[node] = to < 0 || w.sunk[node] < 0 ? to : w.sunk[node] + share * (to - w.sunk[node]);
  }
}

}  // namespace vest::fluid
