#pragma once

#include <vector>

#include <Eigen/Core>

#include "vest_tissue/scene/description.h"

namespace vest::scene {

/// Gives a round skin texture coordinates that are spread on the plane like an orange peel (m), from an
/// azimuthal equidistant map about the direction `facing` as seen from the middle, then relaxed until edges
/// have their own length. Even where it is looked at, torn only opposite to it. Leaves a skin without area as
/// it is.
/// @param knots m, that the skin is bound to
/// @param facing not zero, of any length: from the middle to the part of the wall that is looked at
void spreadTexture(const std::vector<Eigen::Vector3d>& knots, const Eigen::Vector3d& facing, Skin* skin);

}  // namespace vest::scene
