#pragma once

#include <vector>

#include "vest_viz/mesh/store.h"

namespace vest::mesh {

/// How open each skin vertex lies to its surroundings, per object and vertex: 1 open … 0 buried. Baked from
/// the present shape by marching rays of up to 25 mm through a 3 mm occupancy grid; cosine-weighted
/// directions. The light sits at the lens, so there are no cast shadows: this is what sets organs apart in
/// the folds.
std::vector<std::vector<float>> ambientOcclusion(const Store& store);

}  // namespace vest::mesh
