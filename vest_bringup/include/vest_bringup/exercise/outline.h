#pragma once

#include <string>
#include <vector>

#include "vest_bringup/exercise/exercise.h"
#include "vest_tissue/scene/world.h"

namespace vest::exercise {

/// A mark as a closed line on its object: around a tube that it lies in, else a circle of the
/// mark's radius on the surface.
struct Outline {
  std::string mark, object;
  std::vector<Eigen::Vector3d> line;  ///< m, world, in the scene as it is loaded
};

/// Of the marks that have a place on an object of this scene. @param world before its first step
std::vector<Outline> outlinesOf(const Exercise& exercise, const scene::World& world);

}  // namespace vest::exercise
