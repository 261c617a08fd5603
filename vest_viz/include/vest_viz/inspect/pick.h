#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "vest_viz/mesh/store.h"

namespace vest::inspect {

/// A knot or a link of a store.
struct Picked {
  enum class Kind { Nothing, Knot, Link };
  Kind kind = Kind::Nothing;
  std::size_t object = 0, element = 0;
  double distance = 0;  ///< m, along the ray
};

/// The nearest knot within `reach` of the ray; where there is none, the nearest living link. Things farther
/// behind the first skin than 1 cm do not count.
/// @param eye m, world; @param direction length 1; @param reach rad: angle between ray and thing
Picked pick(const mesh::Store& store, const Eigen::Vector3d& eye, const Eigen::Vector3d& direction,
            double reach);

/// All that the store knows of it, a line "what: value unit" each; empty if it does not exist (any more).
std::vector<std::string> describe(const mesh::Store& store, const Picked& picked);

/// Distance along a ray to the first skin; infinite if none is hit.
double firstSkin(const mesh::Store& store, const Eigen::Vector3d& eye, const Eigen::Vector3d& direction);

}  // namespace vest::inspect
