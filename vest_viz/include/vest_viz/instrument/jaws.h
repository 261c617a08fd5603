#pragma once

#include <vector>

#include <Eigen/Geometry>

namespace vest::instrument {

/// The jaws of an instrument, as tools::ToolGeometry describes them.
struct Jaws {
  Eigen::Isometry3d X_WTip = Eigen::Isometry3d::Identity();  ///< tip frame: z along the shaft, x the opening
  double opening = 0;                                        ///< rad, between the two
  double length = 0;                                         ///< m, axis of the jaws to their point
};

/// Presses what the jaws hold flat between them, in the picture: the simulated tissue is held at knots some
/// millimetres apart, and its skin between them would pass through the metal. Vertices near the jaws (2 mm
/// to either side, fading over 3 mm) are drawn no farther from the middle than the jaws' inner faces.
/// @param positions m, world; x y z per vertex
/// @return true if one of them moved
bool pressBetween(const Jaws& jaws, std::vector<float>* positions);

}  // namespace vest::instrument
