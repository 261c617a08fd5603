#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <Eigen/LU>

#include "vest_tissue/scene/description.h"
#include "vest_tissue/volume/image.h"

/// Deformable volume models: lattices of tetrahedra that fill an image or a closed surface.
namespace vest::volume {

using Index = std::uint32_t;

/// Triangles in space.
struct Surface {
  std::vector<Eigen::Vector3d> vertices;        ///< m, world
  std::vector<std::array<Index, 3>> triangles;  ///< counter-clockwise from outside
};

struct Lattice {
  std::vector<Eigen::Vector3d> nodes;            ///< m, world
  std::vector<std::array<Index, 4>> tetrahedra;  ///< positive volume
  std::vector<std::uint16_t> label;              ///< per tetrahedron
};

inline constexpr std::size_t kMostCubes = 200000;  ///< of a lattice's box (assumed)

/// Cubes of edge `cell` along the image's axes, five tetrahedra each, mirrored from cube to cube so that they
/// fit. A cube belongs to the label that most of its 4 × 4 × 4 samples have; it is left out where more than
/// half of them have none.
/// @throws std::invalid_argument: what is wrong, what is allowed
Lattice fillImage(const LabelledImage& image, double cell);

/// The same along the world's axes, inside a closed surface: a cube belongs to it where at least half of its
/// 2 × 2 × 2 samples lie inside. Inside: winding number > 0, from signed crossings along x.
/// @throws std::invalid_argument: an edge without its opposite, no volume, too many cubes
Lattice fillSurface(const Surface& surface, double cell);

/// Smooth surface of an image's labels, from samples `cell` apart (surface nets: Gibson 1998,
/// doi 10.1007/BFb0056277).
Surface surfaceOf(const LabelledImage& image, double cell);

/// Moves boundary nodes of the lattice onto the surface where it is nearer than 0.7 cell, as far as every
/// tetrahedron keeps a quarter of its volume.
void fitBoundary(Lattice& lattice, const Surface& surface, double cell);

/// Binds each vertex of the surface to the four nodes of the tetrahedron that holds it, or of the nearest one
/// (weights then go below 0 or above 1): barycentric coordinates.
scene::Skin embed(const Lattice& lattice, const Surface& surface);

}  // namespace vest::volume
