#pragma once

#include <vector>

#include <Eigen/Core>

namespace vest::mesh {

/// A cavity's wall that sinks while gas is lost: straight down, by all of `sunk` at its highest place, by
/// nothing in its lower half, and smoothly between. It comes to lie on its lower half at most. The endoscope
/// in its trocar props it up: within some centimetres beside the lens the wall hangs less (kProp; assumed).
/// @param sunk m, of its highest place: GasState::sunk
/// @param lens m, world  @param positions x y z per vertex, m, world
void sinkWall(double sunk, const Eigen::Vector3d& lens, std::vector<float>* positions);
constexpr double kProp = 0.03;       ///< m: there it hangs half as much as far from the lens
constexpr double kSeenSunk = 0.001;  ///< m: less is not drawn

}  // namespace vest::mesh
