#pragma once

#include <string>

#include "vest_tissue/volume/lattice.h"

namespace vest::volume {

/// Tetrahedra of a mesh file, by its ending: .msh (gmsh ASCII, 2.2 and 4.1; label: the first physical group
/// of the volume, else 0) or .vtk (legacy ASCII, UNSTRUCTURED_GRID; label: integer cell scalars, else 0).
/// Nodes keep the order of the file. Points, lines and faces are left out; other volumes are refused. gmsh's
/// own library is GPL and VTK's headers are no dependency, so the two text formats are read here.
/// @param path for messages @throws std::invalid_argument: file, line, what is allowed
Lattice readTetrahedra(const std::string& path, const std::string& bytes);

/// Triangles of a surface file, by its ending: .obj, .stl (text or binary) or .ply (text or binary). Vertices
/// at exactly the same place are one vertex; polygons become fans. Indices that do not exist, corners at one
/// place, coordinates beyond 1e38, unknown words and wrong counts are refused. Its size is judged where a
/// mesh is. @throws std::invalid_argument
Surface readSurface(const std::string& path, const std::string& bytes);

/// Behind the last dot, in small letters.
std::string endingOf(const std::string& path);

}  // namespace vest::volume
