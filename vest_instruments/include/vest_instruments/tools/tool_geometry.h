#pragma once

#include <array>
#include <vector>

#include <Eigen/Core>

#include "vest_instruments/tools/tool_kind.h"

namespace vest::tools {

/// A capsule: all points within `radius` of the segment a…b. Metres.
struct Capsule {
  Eigen::Vector3d a;
  Eigen::Vector3d b;
  double radius;
};

/// Geometry that tissue, collision and pictures share. Metres and radians.
///
///            x (jaws open along x)
///            |      __.--- jaw 0, turned by +jaw/2 about +y
///   shaft ===o=====<
///      pivot of    ''.--- jaw 1, turned by -jaw/2
///      the jaws    |----->z  origin of the tip frame = point of the CLOSED jaws
///
/// Tip frame: z along the shaft, outward to the tissue; x the opening direction; y the jaws' axis.
struct ToolGeometry {
  ToolKind kind = ToolKind::None;
  double shaft_radius = 0.0025;  ///< m; the shaft is a capsule from the trocar's pivot to the jaws' axis
  double jaw_length = 0.0;       ///< m; axis of the jaws to their point; 0: no jaws
  double max_jaw_angle = 0.0;    ///< rad, full opening; 0: no jaws
  std::vector<Capsule> fixed;    ///< beyond the shaft, in the tip frame (hook, cannula)
  std::array<std::vector<Capsule>, 2>
      jaw;  ///< in the jaw's frame: origin on the jaws' axis, z to the jaw's point when closed
  std::vector<Eigen::Vector3d>
      interaction_points;  ///< where it is tried against what it touches; tip frame, jaws closed
};

/// Geometry of a kind; the reference lives for ever. Total: every kind has one (None has no capsules).
const ToolGeometry& toolGeometry(ToolKind kind);

}  // namespace vest::tools
