#pragma once

#include <array>
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

/// A surface with more vertices where others lie on it, so that their dark seam is as narrow as it should be.
/// Each new one lies midway between two of those before it; they follow after the surface's own.
struct Refined {
  std::vector<std::uint32_t> triangles;
  std::vector<std::array<std::uint32_t, 2>> middles;

  /// Values of the new vertices, appended to those of the old. @param per values a vertex
  template <class T>
  void append(std::size_t per, std::vector<T>* values) const {
    for (const auto& m : middles)
      for (std::size_t k = 0; k < per; ++k)
        values->push_back(static_cast<T>(((*values)[per * m[0] + k] + (*values)[per * m[1] + k]) / 2));
  }
};
Refined refineForContact(const std::vector<Surface>& surfaces, std::size_t index);

/// How open each skin vertex lies to its surroundings, per object and vertex: 1 open … 0 buried. Baked from
/// the present shape by marching rays of up to 25 mm through a 3 mm occupancy grid; cosine-weighted
/// directions. The light sits at the lens, so there are no cast shadows: this is what sets organs apart in
/// the folds. Empty where the scene is too large; takes some tenths of a second.
/// @param stop may be null; once true, what is done by then is answered
std::vector<std::vector<float>> ambientOcclusion(const std::vector<Surface>& surfaces,
                                                 const std::atomic<bool>* stop = nullptr);

}  // namespace vest::mesh
