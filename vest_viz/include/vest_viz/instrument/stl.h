#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace vest::instrument {

/// Triangles ready to draw: one normal per vertex, vertices shared where the surface is smooth.
struct TriangleMesh {
  std::vector<float> positions;  ///< m, x y z per vertex
  std::vector<float> normals;    ///< unit length
  std::vector<std::uint32_t> triangles;
};

/// Reads an STL file (text or binary), metres. Edges sharper than `crease` stay sharp.
/// @param crease rad
/// @throws std::runtime_error naming file and reason: volume::readSurface() refuses it, or it has over 16 MB
TriangleMesh readStl(const std::string& path, double crease);

/// Cylinder along z with rounded ends, for tools without a mesh.
/// @param radius, z0, z1 m
TriangleMesh capsule(double radius, double z0, double z1);

}  // namespace vest::instrument
