#include "vest_tissue/net/link_kernel.h"

#include "vest_tissue/net/knot_loops.h"

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <tuple>

#include "link_kernel_body.h"

namespace vest::net {
namespace {

// Shorter runs cost more in padding than their indices save.
constexpr std::size_t kShortestRun = 5;
// A gap of a few links inside a run (the ends of a tube's lines) is filled with dead lanes: cheaper than a
// new run.
constexpr std::uint32_t kLongestGap = 4;

// A processor waits for a sum of forces that it has just stored when it reads it back shifted by less than a
// block. So neighbours in the order of adding share no such knots, where another block can be found among the
// next few (docs/decisions/0011-…).
constexpr std::size_t kApart = 2;
constexpr std::size_t kCandidates = 64;

int shifted(std::uint32_t a, std::uint32_t b) {
  const std::uint32_t distance = a < b ? b - a : a - b;
  return distance != 0 && distance < kLanes ? 1 : 0;
}
int shifted(const LinkTable::Place& a, const LinkTable::Place& b) {
  return shifted(a.knot0, b.knot0) + shifted(a.knot0, b.knot1) + shifted(a.knot1, b.knot0) +
         shifted(a.knot1, b.knot1);
}

/// Order in which the blocks' forces are added; the first of the best, so it is the same everywhere.
std::vector<std::uint32_t> orderOfAdding(const std::vector<LinkTable::Place>& places) {
  std::vector<std::uint32_t> left, order;  // left: what is open, in order of knots
  left.reserve(kCandidates);
  std::uint32_t next = 0;
  while (order.size() < places.size()) {
    while (left.size() < kCandidates && next < places.size()) left.push_back(next++);
    const auto cost = [&](std::uint32_t block) {
      int sum = 0;
      for (std::size_t back = 1; back <= std::min(kApart, order.size()); ++back)
        sum +=
            static_cast<int>(kApart + 1 - back) * shifted(places[block], places[order[order.size() - back]]);
      return sum;
    };
    const auto best = std::min_element(left.begin(), left.end(),
                                       [&](std::uint32_t a, std::uint32_t b) { return cost(a) < cost(b); });
    order.push_back(*best);
    left.erase(best);
  }
  return order;
}

LinkTable::Block emptyBlock() {
  LinkTable::Block b{};
  std::fill_n(b.rest, kLanes, 1.0f);
  std::fill_n(b.inverse_rest, kLanes, 1.0f);
  return b;
}

}  // namespace

LinkTable::LinkTable(const std::vector<KernelLink>& links, const material::Law& law, std::size_t spare,
                     const std::vector<std::uint8_t>& held) {
  law_.a2 = static_cast<float>(law.a2);
  law_.a3 = static_cast<float>(law.a3);
  law_.a4 = static_cast<float>(law.a4);
  law_.max_strain = static_cast<float>(law.max_strain);
  setMaxStrain(law_.max_strain);

  slot_.resize(links.size() + spare);
  count_ = built_ = links.size();
  std::vector<std::uint32_t> order;
  for (std::uint32_t n = 0; n < links.size(); ++n) {
    const KernelLink& l = links[n];
    if (held.empty() || held[l.knot0] == 0 || held[l.knot1] == 0)
      order.push_back(n);
    else
      slot_[n] = kNowhere;
  }
  const auto low = [&](std::uint32_t n) { return std::min(links[n].knot0, links[n].knot1); };
  const auto high = [&](std::uint32_t n) { return std::max(links[n].knot0, links[n].knot1); };
  std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
    return std::make_tuple(high(a) - low(a), low(a), a) < std::make_tuple(high(b) - low(b), low(b), b);
  });

  std::vector<std::uint32_t> indexed;
  std::vector<Place> places;
  for (std::size_t begin = 0; begin < order.size();) {
    std::size_t end = begin + 1;
    const auto difference = [&](std::size_t n) { return high(order[n]) - low(order[n]); };
    while (end < order.size() && difference(end) == difference(begin) &&
           low(order[end]) > low(order[end - 1]) &&
           low(order[end]) - low(order[end - 1]) <= 1 + kLongestGap) {
      ++end;
    }
    if (end - begin >= kShortestRun) {
      const std::uint32_t first = low(order[begin]);
      const std::uint32_t block = static_cast<std::uint32_t>(places.size());
      for (std::size_t n = begin; n < end; ++n)
        slot_[order[n]] = block * static_cast<std::uint32_t>(kLanes) + low(order[n]) - first;
      for (std::uint32_t knot = first; knot <= low(order[end - 1]); knot += kLanes)
        places.push_back({knot, knot + difference(begin)});
      ++runs_;
    } else {
      indexed.insert(indexed.end(), order.begin() + begin, order.begin() + end);
    }
    begin = end;
  }
  const std::vector<std::uint32_t> adding = orderOfAdding(places);
  std::vector<std::uint32_t> position(places.size());
  for (std::uint32_t n = 0; n < adding.size(); ++n) {
    places_.push_back(places[adding[n]]);
    position[adding[n]] = n;
  }
  std::vector<bool> in_run(links.size(), true);
  for (const std::uint32_t n : indexed) in_run[n] = false;
  for (std::size_t n = 0; n < links.size(); ++n)
    if (in_run[n] && slot_[n] != kNowhere)
      slot_[n] = position[slot_[n] / kLanes] * static_cast<std::uint32_t>(kLanes) + slot_[n] % kLanes;
  blocks_.assign(places_.size(), emptyBlock());
  first_indexed_block_ = static_cast<std::uint32_t>(blocks_.size());
  for (std::size_t n = 0; n < indexed.size(); ++n) {
    if (n % kLanes == 0) {
      blocks_.push_back(emptyBlock());
      // Padded lanes add zero to knot 0.
      indices_.push_back(Indices{});
    }
    indices_.back().knot0[n % kLanes] = low(indexed[n]);
    indices_.back().knot1[n % kLanes] = high(indexed[n]);
    slot_[indexed[n]] = static_cast<std::uint32_t>(first_indexed_block_ * kLanes + n);
    indexed_knots_ = std::max(indexed_knots_, high(indexed[n]) + 1);
  }
  spare_ = static_cast<std::uint32_t>(blocks_.size() * kLanes);
  const std::size_t spare_blocks = (spare + kLanes - 1) / kLanes;
  blocks_.resize(blocks_.size() + spare_blocks, emptyBlock());
  indices_.resize(indices_.size() + spare_blocks);
  for (std::size_t n = 0; n < links.size(); ++n) setLink(n, links[n].rest, links[n].axial, links[n].damping);
}

void LinkTable::setLink(std::size_t index, float rest, float axial, float damping) {
  if (slot_[index] == kNowhere) return;
  Block& b = blocks_[slot_[index] / kLanes];
  const std::size_t lane = slot_[index] % kLanes;
  b.rest[lane] = rest;
  b.inverse_rest[lane] = 1.0f / rest;
  b.axial[lane] = axial;
  b.damping[lane] = damping;
}

bool LinkTable::addLink(const KernelLink& link) {
  if (spare_ >= blocks_.size() * kLanes || count_ == slot_.size()) return false;
  Indices& index = indices_[spare_ / kLanes - first_indexed_block_];
  index.knot0[spare_ % kLanes] = link.knot0;
  index.knot1[spare_ % kLanes] = link.knot1;
  indexed_knots_ = std::max({indexed_knots_, link.knot0 + 1, link.knot1 + 1});
  slot_[count_] = spare_++;
  setLink(count_++, link.rest, link.axial, link.damping);
  return true;
}

void LinkTable::dropLinks(std::size_t count) {
  while (count_ > std::max(count, built_)) {
    setLink(--count_, 1.0f, 0.0f, 0.0f);
    --spare_;
    Indices& index = indices_[spare_ / kLanes - first_indexed_block_];
    index.knot0[spare_ % kLanes] = index.knot1[spare_ % kLanes] = 0;
  }
}

void LinkTable::setMaxStrain(float max_strain) {
  const float e = max_strain;
  law_.max_strain = max_strain;
  law_.beyond = e * (2.0f * law_.a2 + e * (3.0f * law_.a3 + e * 4.0f * law_.a4));
  law_.tail = 1.0f + law_.beyond;
}

double LinkTable::occupancy() const {
  return blocks_.empty() ? 1.0
                         : static_cast<double>(count_) /
                               static_cast<double>((first_indexed_block_ + indexedBlocks()) * kLanes);
}

KernelLevel chooseKernelLevel() {
#if defined(VEST_HAVE_AVX2_KERNEL)
  const char* wish = std::getenv("VEST_KERNEL");
  if (wish != nullptr && std::strcmp(wish, "baseline") == 0) return KernelLevel::Baseline;
  if (__builtin_cpu_supports("avx2")) return KernelLevel::Avx2;
#endif
  return KernelLevel::Baseline;
}

std::string_view kernelLevelName(KernelLevel level) {
  return level == KernelLevel::Avx2 ? "avx2" : "baseline";
}

void addLinkForces(const LinkTable& table, const KnotArrays& knots, KernelLevel level) {
#if defined(VEST_HAVE_AVX2_KERNEL)
  if (level == KernelLevel::Avx2) {
    kernel::addLinkForcesAvx2(table, knots);
    return;
  }
#else
  (void)level;
#endif
  kernel::addLinkForcesBaseline(table, knots);
}

void integrateKnots(const MotionArrays& a, float dt, KernelLevel level) {
#if defined(VEST_HAVE_AVX2_KERNEL)
  if (level == KernelLevel::Avx2) {
    kernel::integrateKnotsAvx2(a, dt);
    return;
  }
#else
  (void)level;
#endif
  kernel::integrateKnotsBaseline(a, dt);
}

namespace kernel {
extern const KnotLoops kKnotLoopsBaseline, kKnotLoopsAvx2;
}

const KnotLoops& knotLoops(KernelLevel level) {
#if defined(VEST_HAVE_AVX2_KERNEL)
  if (level == KernelLevel::Avx2) return kernel::kKnotLoopsAvx2;
#else
  (void)level;
#endif
  return kernel::kKnotLoopsBaseline;
}

}  // namespace vest::net
