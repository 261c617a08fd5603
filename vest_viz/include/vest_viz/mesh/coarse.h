#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <vector>

namespace vest::mesh {

/// Fewer triangles for drawing a skin from afar, over the same vertices: those left out are not named any
/// more, all others keep index, texture coordinates and motion. Edges collapse while the surface stays within
/// `tolerance` and its triangles turn by less than 20°; rims, seams of the texture and what lies next to
/// sharp edges stay. A software renderer pays by the triangle where these are smaller than some ten pixels.
/// By OpenMesh's decimater: quadric error metric, Garland and Heckbert 1997, doi:10.1145/258734.258849.
/// @param positions x y z per vertex, m, of the shape at rest
/// @param triangles three vertices each; what no mesh can be made of (an edge with three faces) comes back as
/// it is
/// @param tolerance m, > 0
/// @param kept_from vertices from here on stay
std::vector<std::uint32_t> coarseTriangles(const std::vector<float>& positions,
                                           const std::vector<std::uint32_t>& triangles, double tolerance,
                                           std::size_t kept_from = SIZE_MAX);

/// A vertex that coarseTriangles left out, and the place of the coarse surface that is drawn for it.
struct LeftOut {
  std::uint32_t vertex;
  std::array<std::uint32_t, 3> corners;
  std::array<float, 3> weights;  ///< barycentric
};
/// Where the vertices of `triangles` that `coarse` does not name lie on it, in the shape at rest.
/// @param stop ends the search early, with what was found; may be null
std::vector<LeftOut> leftOut(const std::vector<float>& positions, const std::vector<std::uint32_t>& triangles,
                             const std::vector<std::uint32_t>& coarse, const std::atomic<bool>* stop);
/// Values of all vertices as they are drawn with the coarse triangles: those kept take the mean of what lies
/// round them, so that no dark vertex stands for a bright surface.
/// @param values one per vertex
std::vector<float> coarseValues(const std::vector<LeftOut>& left_out, const std::vector<float>& values);
/// Greatest distance of such a vertex from its place now, m: the detail of a tissue that has been bent, tied
/// or squeezed which the coarse surface does not show. A motion of the whole changes it by no more than the
/// tolerance.
float greatestGap(const std::vector<LeftOut>& left_out, const std::vector<float>& positions);

}  // namespace vest::mesh
