#pragma once

#include <atomic>
#include <cstdint>
#include <vector>

#include "vest_viz/mesh/store.h"

namespace vest::mesh {

/// A skin as it lies now, apart from the Store, for a worker.
struct Surface {
  std::vector<float> positions, normals;  ///< xyz per vertex, m in world; unit vectors
  std::vector<std::uint32_t> triangles;
};
std::vector<Surface> surfacesOf(const Store& store);

/// How open each skin vertex lies to its surroundings, per object and vertex: 1 open … 0 buried. Baked from
/// the present shape by marching rays of up to 25 mm through a 3 mm occupancy grid; cosine-weighted
/// directions. The light sits at the lens, so there are no cast shadows: this is what sets organs apart in
/// the folds. Empty where the scene is too large; takes some tenths of a second.
/// @param stop may be null; once true, what is done by then is answered
std::vector<std::vector<float>> ambientOcclusion(const std::vector<Surface>& surfaces,
                                                 const std::atomic<bool>* stop = nullptr);

}  // namespace vest::mesh
