#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "vest_tissue/modelling/spline.h"

/// Walls of several layers, as elements: an outer surface that is repeated inwards.
namespace vest::modelling {

struct Layer {
  std::string material;
  double thickness = 0.0;      ///< m
  std::uint32_t elements = 1;  ///< across it
};

struct LayeredMesh {
  std::vector<Vector3> nodes;  ///< m, surface by surface; the first are those of the outer one, in its order
  std::vector<std::array<std::uint32_t, 4>> tetrahedra;  ///< of positive volume
  std::vector<std::uint16_t> layer;                      ///< per tetrahedron, from 0, the outer one
};

/// Layers from outside to inside along the normals of a surface's points (weighted by angle). Each triangle
/// is a column of prisms, each prism three tetrahedra, divided by the order of its points: neighbours fit.
/// @param triangles counter-clockwise from outside; where they end, the wall is open
/// @throws std::invalid_argument where the wall is too thick for its curvature, with the place
LayeredMesh makeLayers(const std::vector<Vector3>& surface,
                       const std::vector<std::array<std::uint32_t, 3>>& triangles,
                       const std::vector<Layer>& layers);

/// A mesh file (gmsh 2.2), exact: the layer + 1 is the physical group.
std::string meshText(const std::vector<Vector3>& nodes,
                     const std::vector<std::array<std::uint32_t, 4>>& tetrahedra,
                     const std::vector<std::uint16_t>& group);

}  // namespace vest::modelling
