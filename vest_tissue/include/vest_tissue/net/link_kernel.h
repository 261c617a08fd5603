#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>
#include <vector>

#include "vest_tissue/material/law.h"
#include "vest_tissue/net/upcoming.h"

/// The hot loop of a net: forces of elastic and viscous links over structure-of-arrays knots of one object.
///
/// Links are packed by eights. Where links (i+t, j+t), t = 0 … n-1, lie next to each other they form a *run*,
/// which needs no indices (knots numbered along the tube make nearly all links runs); the others keep two
/// indices each. A kernel level (baseline, avx2) changes the instructions, never a bit of the result: every
/// lane does the same correctly rounded operations in the same order, without contraction.
namespace vest::net {

inline constexpr std::size_t kLanes = 8;

/// One link as given. Force on knot0 is +s·d, on knot1 -s·d, with d = x1 - x0, l = |d|, eps = l/rest - 1,
///   s·l = axial·sigma(eps)/E + damping·(v1 - v0)·d/l         (elastic and viscous part;
///   sigma: material/law.h)
struct KernelLink {
  std::uint32_t knot0 = 0;
  std::uint32_t knot1 = 0;
  float rest = 1;     ///< m, > 0
  float axial = 0;    ///< N: E·area of the law, or k·rest of the linear form; 0 for a purely viscous link
  float damping = 0;  ///< N·s/m
};

/// Links that share a law, packed. A dead link has axial = damping = 0: setLink changes it in place.
class LinkTable {
 public:
  LinkTable() = default;
  /// @param law E is not used here (it is inside `axial`); a2 … a4 and max_strain are. A linear form has all
  /// three zero.
  /// @param links need not be ordered; knot0 != knot1
  /// @param spare room for that many links more (addLink)
  /// @param held per knot, not 0: nothing moves it. Links between two of them are left out of the sums.
  LinkTable(const std::vector<KernelLink>& links, const material::Law& law, std::size_t spare = 0,
            const std::vector<std::uint8_t>& held = {});

  /// Changes the parameters of link `index` (position in the constructor's vector). Nothing for one left out.
  void setLink(std::size_t index, float rest, float axial, float damping);
  /// Uses a spare place; its index is linkCount() before. False when none is left. Real-time safe.
  bool addLink(const KernelLink& link);
  /// The last ones that addLink made go, until `count` are left or all of them are gone.
  void dropLinks(std::size_t count);
  /// From this strain on the law follows its tangent (a declared fallback lowers it). Real-time safe.
  void setMaxStrain(float max_strain);
  /// What addLinkForces reads of the table.
  void addMemory(Upcoming& to) const {
    to.add(blocks_.data(), blocks_.size() * sizeof(Block));
    to.add(places_.data(), places_.size() * sizeof(Place));
    to.add(indices_.data(), indices_.size() * sizeof(Indices));
  }
  std::size_t linkCount() const { return count_; }
  /// Runs that were long enough to need no indices.
  std::size_t runCount() const { return runs_; }
  /// Share of lanes that hold a link, no unit.
  double occupancy() const;

  struct Block {  ///< parameters of eight links
    alignas(32) float rest[kLanes];
    alignas(32) float inverse_rest[kLanes];
    alignas(32) float axial[kLanes];
    alignas(32) float damping[kLanes];
  };
  struct Place {
    std::uint32_t knot0, knot1;  ///< of the first of eight links of a run
  };
  struct Indices {
    std::uint32_t knot0[kLanes];
    std::uint32_t knot1[kLanes];
  };
  struct LawConstants {
    float a2 = 0, a3 = 0, a4 = 0, max_strain = 0;
    float tail = 1;    ///< tangent at max_strain over E, no unit
    float beyond = 0;  ///< tail - 1
    bool straight() const { return a2 == 0 && a3 == 0 && a4 == 0; }
  };

  /// Of the first firstIndexedBlock() blocks, in the order in which their forces are added.
  const std::vector<Place>& places() const { return places_; }
  const std::vector<Block>& blocks() const { return blocks_; }
  const std::vector<Indices>& indices() const { return indices_; }
  /// Indexed blocks in use; behind them lie spare ones.
  std::size_t indexedBlocks() const { return (spare_ + kLanes - 1) / kLanes - first_indexed_block_; }
  std::uint32_t firstIndexedBlock() const { return first_indexed_block_; }
  const LawConstants& law() const { return law_; }
  /// One past the greatest knot of the indexed links.
  std::size_t indexedKnots() const { return indexed_knots_; }

 private:
  std::vector<Place> places_;     ///< one per block of a run
  std::vector<Block> blocks_;     ///< of the runs, then of the indexed links
  std::vector<Indices> indices_;  ///< one per indexed block
  static constexpr std::uint32_t kNowhere = ~0u;
  std::vector<std::uint32_t> slot_;  ///< block·8 + lane per link as given, or kNowhere
  std::uint32_t first_indexed_block_ = 0;
  std::uint32_t indexed_knots_ = 0;
  LawConstants law_;
  std::size_t count_ = 0, built_ = 0, runs_ = 0;
  std::uint32_t spare_ = 0;  ///< next unused place, block·8 + lane
};

/// Knots of one object. Arrays need kLanes floats of finite padding behind the last knot. Metres, m/s,
/// newtons.
struct KnotArrays {
  const float* x;
  const float* y;
  const float* z;
  const float* vx;
  const float* vy;
  const float* vz;
  float* fx;
  float* fy;
  float* fz;
  /// Room for kPackedFloats floats a knot (padding included), no meaning between calls; null: links without
  /// runs take the slower way, with the same bits.
  float* packed = nullptr;
};
inline constexpr std::size_t kPackedFloats = 12;

enum class KernelLevel : std::uint8_t { Baseline = 0, Avx2 = 1 };

/// Best level of this processor, or what VEST_KERNEL=baseline|avx2 asks for (an unsupported wish falls back
/// to baseline). Reads the environment: call it once, outside of a step.
KernelLevel chooseKernelLevel();
std::string_view kernelLevelName(KernelLevel level);

/// Adds the forces of all links in the table to f. Real-time safe.
void addLinkForces(const LinkTable& table, const KnotArrays& knots, KernelLevel level);

/// What an integration touches. `n` knots, padded to a multiple of kLanes.
struct MotionArrays {
  std::size_t n = 0;
  float *x, *y, *z, *vx, *vy, *vz, *fx, *fy, *fz;
  const float *hx, *hy, *hz;  ///< N: what the sum of forces begins with in the next sub-step
  const float* keep;          ///< 1/(1 + dt·gamma/m), no unit; see integrateKnots
  const float* push;          ///< dt/m, s/kg; 0 for fixed knots
};

/// Newton-Euler (symplectic Euler) step: v = keep·(v + push·f), x += dt·v, then f = h.
void integrateKnots(const MotionArrays& a, float dt, KernelLevel level);

}  // namespace vest::net
