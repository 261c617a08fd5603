#pragma once

#include <cstdint>
#include <vector>

#include "vest_tissue/net/block.h"
#include "vest_tissue/net/elements.h"

namespace vest::solver {

/// What limits an explicit step: the square of the highest frequency and the highest decay rate of the
/// damping.
struct Rates {
  double omega_squared = 0.0;  ///< 1/s²
  double decay = 0.0;          ///< 1/s: greatest eigenvalue of M⁻¹C
};

/// Room for the bound: per knot the six entries of a symmetric 3×3 stiffness.
struct BoundScratch {
  std::vector<float> tensor;
  explicit BoundScratch(std::size_t knots = 0) : tensor(6 * knots) {}
};

/// The links of an object at the present positions.
struct BoundLinks {
  const net::Block* block = nullptr;
  const net::KernelLink* first = nullptr;  ///< first link's numbers
  std::size_t stride = 0;                  ///< bytes between links
  std::size_t count = 0;
  const bool* by_law = nullptr;  ///< of the first link, same stride
  net::LinkTable::LawConstants law;

  const net::KernelLink& link(std::size_t i) const {
    return *reinterpret_cast<const net::KernelLink*>(reinterpret_cast<const char*>(first) + i * stride);
  }
  bool lawOf(std::size_t i) const {
    return *(reinterpret_cast<const bool*>(reinterpret_cast<const char*>(by_law) + i * stride));
  }
};

/// Rigorous upper bound of the links' rates at the present positions, tangent and tension included:
/// (sum of g_i·x_i)² <= n·sum (g_i·x_i)² for an element of n knots, so omega² <= 2·max_i |sum_e k_e u
/// u^T|/m_i, and the row-sum norm bounds |.|.
Rates linkRates(const BoundLinks& links, BoundScratch& scratch);
/// The same for links' damping alone and for the slower elements (bending, hinges, plastic, tethers,
/// volumes).
double linkDecay(const BoundLinks& links, BoundScratch& scratch);
Rates elementRates(const net::Block& block, const net::Elements& elements, BoundScratch& scratch);
/// omega² of the enclosed volumes alone at the present positions: K/V0·sum |dV/dx_i|²/m_i each.
double volumeRate(const net::Block& block, const net::Elements& elements, BoundScratch& scratch);
/// Power iteration on M⁻¹K of the links at the present positions (deterministic start, `iterations` sweeps):
/// a lower bound that converges to omega². Allocates: for loading only.
double powerIteration(const BoundLinks& links, int iterations);
/// Greatest strain of the living links (0 if all are compressed). Cheap: what tells whether a new bound is
/// needed.
float greatestStrain(const BoundLinks& links);

/// Longest stable step of v += dt·a, x += dt·v with explicit damping: (2/omega)(sqrt(1+xi²) - xi), xi =
/// decay/(2 omega).
double longestStep(const Rates& rates);

/// Sub-steps of dt with a margin of 0.8 of the longest stable step, at least 1.
int subSteps(double dt, const Rates& rates);
inline constexpr double kStepMargin = 0.8;
inline constexpr double kSubStepsPerSecond = 64000.0;  ///< 64 a millisecond: beyond it, implicit steps

}  // namespace vest::solver
