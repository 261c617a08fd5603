#pragma once

#include <cstddef>

namespace vest::scene {

/// What a slot of the DeltaHistory has room for from the start. Whoever fills one looks at these numbers and
/// not at capacity(): that depends on what the slot held before, which no snapshot knows.
inline constexpr std::size_t kDeltaLinks = 256, kDeltaKnots = 64;
inline constexpr std::size_t kDeltaTriangles = 512;  ///< of the skin, removed; and added
inline constexpr std::size_t kDeltaVertices = 512;   ///< of the skin, bound anew; and added
inline constexpr std::size_t kDeltaEntries = 4096;   ///< of their bindings

}  // namespace vest::scene
