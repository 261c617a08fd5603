#include "vest_tissue/net/cut_rings.h"

#include <algorithm>

namespace vest::net {

void CutRings::reserve(const TubeMap& tube, std::size_t knots) {
  order_.assign(knots, 0);
  start_.clear();
  std::uint32_t room = 0;
  for (std::size_t r = 0; r < tube.ringCount(); ++r) {
    const auto& ring = tube.knots(r);
    for (std::uint32_t i = 0; i < ring.size(); ++i) order_[ring[i]] = i;
    for (int side = 0; side < 2; ++side)
      start_.push_back(room), room += 2 * static_cast<std::uint32_t>(ring.size());
  }
  count_.assign(start_.size(), 0);
  start_.push_back(room);
  knots_.assign(room, 0), order_of_.assign(room, 0), joined_.assign(room, 0);
  if (room == 0) start_.clear();
}

bool CutRings::whole(const TubeMap& tube, std::size_t ring) const {
  const Ring below = this->ring(tube, ring, false), above = this->ring(tube, ring, true);
  return std::equal(below.begin(), below.end(), above.begin(), above.end());
}

void CutRings::place(const TubeMap& tube, const std::array<std::uint32_t, 3>& triangle,
                     const std::array<std::uint32_t, 3>& of, bool join) {
  std::array<std::int32_t, 3> ring{};
  std::int32_t low = -1, high = -1;
  for (std::size_t e = 0; e < 3; ++e) {
    ring[e] = tube.ringOf(of[e]);
    if (ring[e] < 0) continue;
    low = low < 0 ? ring[e] : std::min(low, ring[e]);
    high = std::max(high, ring[e]);
  }
  if (low == high) return;  // it leads from no ring to another
  // The first and the last ring have one side, which counts as both.
  const auto last = static_cast<std::int32_t>(tube.ringCount()) - 1;
  for (const bool far : {false, true}) {
    std::array<std::int32_t, 3> part{};
    for (std::size_t e = 0; e < 3; ++e) {
      part[e] = ring[e] < 0 ? -1 : 2 * ring[e] + (ring[e] == low ? 1 : 0);
      if (far) part[e] = ring[e] == 0 || ring[e] == last ? part[e] ^ 1 : -1;
      if (!join && part[e] >= 0) insert(static_cast<std::size_t>(part[e]), triangle[e], order_[of[e]]);
    }
    for (std::size_t a = 0; join && a < 3; ++a) {
      for (std::size_t b = 0; b < 3; ++b) {
        if (a == b || part[a] < 0 || part[a] != part[b]) continue;
        const auto p = static_cast<std::size_t>(part[a]);
        const std::size_t count = count_[p], from = find(p, triangle[a]), to = find(p, triangle[b]);
        if (from < count && to < count && (from + 1) % count == to) joined_[start_[p] + from] = 1;
      }
    }
  }
}

std::size_t CutRings::find(std::size_t part, std::uint32_t knot) const {
  const std::uint32_t* const knots = knots_.data() + start_[part];
  return static_cast<std::size_t>(std::find(knots, knots + count_[part], knot) - knots);
}

void CutRings::insert(std::size_t part, std::uint32_t knot, std::uint32_t order) {
  const std::uint32_t first = start_[part], room = start_[part + 1] - first;
  std::uint32_t& count = count_[part];
  if (find(part, knot) < count || count == room) return;
  std::uint32_t* const knots = knots_.data() + first;
  std::uint32_t* const orders = order_of_.data() + first;
  std::uint32_t i = count++;
  for (; i > 0 && (orders[i - 1] > order || (orders[i - 1] == order && knots[i - 1] > knot)); --i)
    knots[i] = knots[i - 1], orders[i] = orders[i - 1];
  knots[i] = knot, orders[i] = order;
}

}  // namespace vest::net
