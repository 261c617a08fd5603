#include <algorithm>

#include "vest_tissue/solver/implicit_net.h"

namespace vest::solver {
namespace {

/// Calls pair(i, j) for each coupling of two knots, once per element.
template <typename Pair>
void eachCoupling(const NetView& net, Pair pair) {
  for (std::size_t n = 0; n < net.links.count; ++n) {
    const net::KernelLink& l = net.links.link(n);
    if (l.axial != 0.0f || l.damping != 0.0f) pair(l.knot0, l.knot1);
  }
  for (const net::Plastic& p : net.elements->plastic) pair(p.a, p.b);
  for (const net::Bending& b : net.elements->bending) pair(b.a, b.b), pair(b.b, b.c), pair(b.a, b.c);
  for (const net::Hinge& h : net.elements->hinges) {
    const std::uint32_t k[4] = {h.edge0, h.edge1, h.wing0, h.wing1};
    for (int i = 0; i < 4; ++i)
      for (int j = i + 1; j < 4; ++j) pair(k[i], k[j]);
  }
  for (const net::Volume& v : net.elements->volumes) {
    if (!isSmall(v)) continue;
    for (std::size_t i = 0; i < v.knots.size(); ++i)
      for (std::size_t j = i + 1; j < v.knots.size(); ++j) pair(v.knots[i], v.knots[j]);
  }
}

}  // namespace

std::size_t KnotOrder::edgesOf(const NetView& net) {
  std::size_t sum = 0;
  eachCoupling(net, [&](std::uint32_t, std::uint32_t) { sum += 2; });
  return sum;
}

KnotOrder::KnotOrder(std::size_t knots, std::size_t edges)
    : start_(knots + 1),
      fill_(knots),
      neighbours_(edges),
      row_(knots),
      order_(knots),
      first_(knots),
      seen_(knots) {}

bool KnotOrder::build(const NetView& net) {
  knots_ = net.links.block->knots();
  if (knots_ > fill_.size()) return false;
  const float* const w = net.links.block->row(net::Block::kInverseMass);
  std::fill(start_.begin(), start_.end(), 0u);
  std::size_t count = 0;
  const auto joined = [&](std::uint32_t i, std::uint32_t j) { return i != j && w[i] > 0.0f && w[j] > 0.0f; };
  eachCoupling(net, [&](std::uint32_t i, std::uint32_t j) {
    if (joined(i, j)) ++start_[i + 1], ++start_[j + 1], count += 2;
  });
  if (count > neighbours_.size()) return false;
  for (std::size_t i = 0; i < knots_; ++i) start_[i + 1] += start_[i], fill_[i] = start_[i];
  eachCoupling(net, [&](std::uint32_t i, std::uint32_t j) {
    if (joined(i, j)) neighbours_[fill_[i]++] = j, neighbours_[fill_[j]++] = i;
  });
  const auto degree = [&](std::uint32_t i) { return start_[i + 1] - start_[i]; };
  std::fill(seen_.begin(), seen_.end(), std::uint8_t{0});
  // Breadth first from a knot; returns the place behind the last one. Neighbours by degree, then number.
  const auto walk = [&](std::uint32_t from, std::size_t begin) {
    std::size_t end = begin;
    order_[end++] = from;
    seen_[from] = 1;
    for (std::size_t at = begin; at < end; ++at) {
      const std::size_t fresh = end;
      for (std::uint32_t e = start_[order_[at]]; e < start_[order_[at] + 1]; ++e) {
        const std::uint32_t j = neighbours_[e];
        if (seen_[j] == 0) seen_[j] = 1, order_[end++] = j;
      }
      std::sort(order_.begin() + static_cast<std::ptrdiff_t>(fresh),
                order_.begin() + static_cast<std::ptrdiff_t>(end), [&](std::uint32_t a, std::uint32_t b) {
                  return degree(a) != degree(b) ? degree(a) < degree(b) : a < b;
                });
    }
    return end;
  };
  std::size_t placed = 0;
  for (std::uint32_t i = 0; i < knots_; ++i) {
    if (seen_[i] != 0) continue;
    // The last knot of a walk lies at the rim: begin there, twice, for a long thin order.
    std::uint32_t from = i;
    for (int pass = 0; pass < 2; ++pass) {
      const std::size_t end = walk(from, placed);
      from = order_[end - 1];
      for (std::size_t n = placed; n < end; ++n) seen_[order_[n]] = 0;
    }
    placed = walk(from, placed);
  }
  for (std::size_t n = 0; n < knots_; ++n) row_[order_[n]] = static_cast<std::uint32_t>(knots_ - 1 - n);
  for (std::size_t i = 0; i < knots_; ++i) first_[row_[i]] = row_[i];
  for (std::uint32_t i = 0; i < knots_; ++i) {
    for (std::uint32_t e = start_[i]; e < start_[i + 1]; ++e)
      first_[row_[i]] = std::min(first_[row_[i]], row_[neighbours_[e]]);
  }
  return true;
}

}  // namespace vest::solver
