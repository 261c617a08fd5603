#pragma once

#include <cstddef>
#include <cstdint>

namespace vest::net {

/// Skin vertices from knots: out[v] = sum over entries e of binding: weight[e]·knot[binding_knots[e]].
/// Viewers use this same function, so that a picture shows what the simulation computed.
/// @param knots          m, x y z per knot (of the object alone)
/// @param binding_start  vertices + 1 entries
/// @param out            m, x y z per vertex, vertices·3 floats
void rebuildSkin(const float* knots, const std::uint32_t* binding_start, const std::uint32_t* binding_knots,
                 const float* binding_weights, std::size_t vertices, float* out);

/// Area-weighted vertex normals, length 1 (0 0 1 where a vertex has no area).
/// @param triangles three vertex indices each, `count` of them, counter-clockwise from outside
void vertexNormals(const float* positions, std::size_t vertices, const std::uint32_t* triangles,
                   std::size_t count, float* normals);

}  // namespace vest::net
