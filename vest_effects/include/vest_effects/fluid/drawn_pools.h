#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "vest_effects/fluid/state.h"

namespace vest::fluid {

/// A connected pool, as a rectangle of cells. Only cells of this pool are wet in it.
struct PoolPatch {
  int column = 0, row = 0, columns = 0, rows = 0;  ///< rectangle in the field
  std::uint32_t label = 0;                         ///< in DrawnPools::labels
  double volume = 0, blood = 0;                    ///< m³
};

/// Surfaces of the largest pools as an eye sees them. The field knows one height over each place: a pool goes
/// on under an organ that spans it, for some cells under the rim of one that is wider, and thin water that
/// runs off an organ's top is none of its surface.
struct DrawnPools {
  std::vector<float> surface;         ///< m, world, per cell; NaN where it is dry
  std::vector<std::uint32_t> labels;  ///< per cell: 0 dry, else the pool's label
  std::vector<PoolPatch> patches;     ///< largest first, at most 16, of at least 0.1 ml
};
/// Not for the step: allocates.
DrawnPools drawnPools(const Model& model, const State& state);

/// m: depth of the pool in a cell where it is seen. Under an organ that spans it the field knows the organ's
/// top alone: there it is the mean of the nearest depths to each side, as the ground goes on, and 1 m where
/// none is near.
float drawnDepth(const Model& model, const Pools& pools, const DrawnPools& drawn, std::size_t cell);

}  // namespace vest::fluid
