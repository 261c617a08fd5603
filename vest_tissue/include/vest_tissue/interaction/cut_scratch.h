#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "vest_tissue/interaction/blade_sweep.h"

namespace vest::interaction {

/// Room for one object's cut at a time: sized for the largest object, no meaning between steps.
struct CutScratch {
  std::array<BladeSweep, kMaxSweeps> sweeps{};
  int sweep_count = 0;
  SweepBox swept, reach;  ///< of the sweeps that cut; and kSweepReach around it
  /// Whether they may cut what lies in a box.
  bool near(const Eigen::Vector3f& low, const Eigen::Vector3f& high) const {
    return reach.holds(low.cast<double>().array() - kSweepReach, high.cast<double>().array() + kSweepReach);
  }

  std::vector<std::uint32_t> incident_start, incident;  ///< alive contact triangles per knot, CSR
  std::vector<std::uint32_t> work;                      ///< knots whose surroundings changed
  std::vector<std::uint8_t> near_knot, near_triangle;   ///< marks
  std::vector<std::uint32_t> version_of;                ///< per knot: the scene's knot of which it is a copy
  std::vector<std::uint32_t> split;                     ///< per knot: knot that it was before this cut
  std::vector<std::uint32_t> before_start, before;      ///< incident as it was before the cut
  std::vector<std::array<std::uint32_t, 3>> triangles_before;
  std::vector<std::uint32_t> part;                ///< per knot: connected piece
  std::vector<std::uint32_t> uncut;               ///< per knot: piece of the surface, had nothing been cut
  std::vector<std::array<std::uint32_t, 2>> rim;  ///< edges of contact triangles that have no neighbour
  std::vector<std::uint8_t> hops;                 ///< per knot, of a search
  std::vector<std::uint32_t> reached;

  std::vector<std::uint32_t> vertex_start, vertex_triangles;  ///< skin triangles per skin vertex, CSR
  std::vector<std::array<std::uint32_t, 3>> skin_now;   ///< per skin triangle, while vertices are doubled
  std::vector<std::uint32_t> moved;                     ///< per skin triangle: its new index
  std::vector<std::uint8_t> border, walled, candidate;  ///< marks of skin vertices and triangles
  std::vector<std::uint32_t> order;                     ///< candidates for a new binding
  std::vector<std::uint32_t> new_start, new_count;      ///< per skin vertex: its new binding below
  std::vector<std::uint32_t> new_knots;
  std::vector<float> new_weights;
  std::vector<std::uint32_t> binding_start, binding_knots;  ///< the whole skin's, anew
  std::vector<float> binding_weights;
};

}  // namespace vest::interaction
