#pragma once

#include <vector>

#include <Eigen/Core>

#include "vest_tissue/base/sunken_wall.h"

namespace vest::mesh {

/// A cavity's wall that sinks while gas is lost, as contact::SunkenWall says.
/// @param sunk m, of its highest place: GasState::sunk
/// @param lens m, world  @param positions x y z per vertex, m, world
void sinkWall(double sunk, const Eigen::Vector3d& lens, std::vector<float>* positions);
constexpr double kSeenSunk = contact::kLeastSunk;  ///< m: less is not drawn

}  // namespace vest::mesh
