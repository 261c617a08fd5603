#pragma once

#include <cstdint>
#include <vector>

namespace vest::mesh {

/// Fewer triangles for drawing a skin from afar, over the same vertices: those left out are not named any
/// more, all others keep index, texture coordinates and motion. Edges collapse while the surface stays within
/// `tolerance` and its triangles turn by less than 20°; rims and seams of the texture stay. A software
/// renderer pays by the triangle where these are smaller than some ten pixels. By OpenMesh's decimater:
/// quadric error metric, Garland and Heckbert 1997, doi:10.1145/258734.258849.
/// @param positions x y z per vertex, m, of the shape at rest
/// @param triangles three vertices each; what no mesh can be made of (an edge with three faces) comes back as
/// it is
/// @param tolerance m, > 0
std::vector<std::uint32_t> coarseTriangles(const std::vector<float>& positions,
                                           const std::vector<std::uint32_t>& triangles, double tolerance);

}  // namespace vest::mesh
