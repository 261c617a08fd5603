#pragma once

#include <vector>

#include <Eigen/Core>

#include "vest_tissue/base/sunken_wall.h"

namespace vest::mesh {

/// A shaft, over which a wall that sinks is stretched like a tent. m, world
struct TentPole {
  Eigen::Vector3d from, to;
  double radius = 0;
};
/// A cavity's wall that sinks while gas is lost, as contact::SunkenWall says; over shafts below it it stays
/// higher. Shafts feel it (300 Pa across them) and do not hold the tissue's wall, which is rigid: the tent is
/// of the picture alone.
/// @param sunk m, of its highest place: GasState::sunk
/// @param lens m, world  @param positions x y z per vertex, m, world
void sinkWall(double sunk, const Eigen::Vector3d& lens, const std::vector<TentPole>& shafts,
              std::vector<float>* positions);
constexpr double kSeenSunk = contact::kLeastSunk;  ///< m: less is not drawn

}  // namespace vest::mesh
