#pragma once

#include <array>
#include <cstdint>

#include <Eigen/Core>

namespace vest::net {

/// A place on or in an object that survives cuts: {object, element, barycentric coordinates}. Clips,
/// stitches, holes, slings, wounds, grasps and connections hold anchors, never raw knot indices; a cut remaps
/// them.
struct Anchor {
  std::uint16_t object = 0;              ///< scene order
  std::array<std::uint32_t, 4> knots{};  ///< knots that carry it (unused ones have weight 0)
  std::array<double, 4> weights{};       ///< barycentric, sum 1
  double height = 0.0;                   ///< m, over the face of the first three knots, along its normal
};

/// A cut doubled knot -> copy: which one carries the anchor afterwards.
struct KnotDoubling {
  std::uint32_t original = 0;
  std::uint32_t copy = 0;
  Eigen::Vector3d plane_normal = Eigen::Vector3d::UnitZ();  ///< of the cut at the knot, to the copy's side
  Eigen::Vector3d plane_point = Eigen::Vector3d::Zero();    ///< m, world
};

/// Moves the anchor's knots onto the side of the cut where the anchor lies. Returns whether anything changed.
bool remap(Anchor& anchor, const KnotDoubling& doubling, const Eigen::Vector3d& anchor_position);

}  // namespace vest::net
