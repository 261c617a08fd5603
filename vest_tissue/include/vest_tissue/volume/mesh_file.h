#pragma once

#include <string>

#include "vest_tissue/volume/lattice.h"

namespace vest::volume {

/// Tetrahedra of a mesh file, by its ending: .msh (gmsh ASCII, 2.2 and 4.1; label: the first physical group
/// of the volume, else 0) or .vtk (legacy ASCII, UNSTRUCTURED_GRID; label: integer cell scalars, else 0).
/// Nodes keep the order of the file; elements of other kinds are left out. gmsh's own library is GPL and
/// VTK's headers are no dependency, so the two text formats are read here.
/// @param path for messages @throws std::invalid_argument: file, line, what is allowed
Lattice readTetrahedra(const std::string& path, const std::string& bytes);

/// Triangles of a surface file through assimp, by its ending: .obj, .stl or .ply. Vertices at exactly the
/// same place are one vertex. @throws std::invalid_argument
Surface readSurface(const std::string& path, const std::string& bytes);

}  // namespace vest::volume
