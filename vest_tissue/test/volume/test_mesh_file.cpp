// Mesh files: the same two tetrahedra in each format, and what is broken is refused.
#include <gtest/gtest.h>

#include <string>

#include "vest_tissue/volume/mesh_file.h"

namespace {

using namespace vest::volume;

const std::string kGmsh22 =
    "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n1\n3 7 \"liver\"\n$EndPhysicalNames\n"
    "$Nodes\n5\n10 0 0 0\n20 1 0 0\n30 0 1 0\n40 0 0 1\n50 1 1 1\n$EndNodes\n"
    "$Elements\n3\n1 2 2 3 1 10 20 30\n2 4 2 7 1 10 20 30 40\n3 4 2 8 1 20 50 30 40\n$EndElements\n";
const std::string kGmsh41 =
    "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n"
    "$Entities\n0 0 1 2\n5 0 0 0 1 1 1 0 0\n1 0 0 0 1 1 1 1 7 1 5\n2 0 0 0 1 1 1 1 8 1 5\n$EndEntities\n"
    "$Nodes\n2 5 10 50\n3 1 0 3\n10\n20\n30\n0 0 0\n1 0 0\n0 1 0\n3 2 0 2\n40\n50\n0 0 1\n1 1 1\n$EndNodes\n"
    "$Elements\n3 3 1 3\n2 5 2 1\n1 10 20 30\n3 1 4 1\n2 10 20 30 40\n3 2 4 1\n3 20 50 30 40\n$EndElements\n";
const std::string kVtk =
    "# vtk DataFile Version 3.0\ntwo\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 5 double\n0 0 0 1 0 0 0 1 0 0 "
    "0 1 1 1 1\n"
    "CELLS 3 14\n3 0 1 2\n4 0 1 2 3\n4 1 4 2 3\nCELL_TYPES 3\n5\n10\n10\nCELL_DATA 3\nSCALARS label int 1\n"
    "LOOKUP_TABLE default\n0 7 8\n";
const std::string kVtk51 =
    "# vtk DataFile Version 5.1\ntwo\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 5 double\n0 0 0 1 0 0 0 1 0 0 "
    "0 1 1 1 1\n"
    "CELLS 4 11\nOFFSETS vtktypeint64\n0 3 7 11\nCONNECTIVITY vtktypeint64\n0 1 2 0 1 2 3 1 4 2 3\n"
    "CELL_TYPES 3\n5\n10\n10\nCELL_DATA 3\nSCALARS label int 1\nLOOKUP_TABLE default\n0 7 8\n";

TEST(MeshFile, EachFormatGivesTheSameTetrahedraInTheOrderOfTheFile) {
  for (const auto& [name, text] : {std::pair{"a.msh", kGmsh22}, std::pair{"b.msh", kGmsh41},
                                   std::pair{"c.vtk", kVtk}, std::pair{"d.vtk", kVtk51}}) {
    const Lattice m = readTetrahedra(name, text);
    ASSERT_EQ(m.nodes.size(), 5u) << name;
    EXPECT_EQ(m.nodes[1], Eigen::Vector3d(1, 0, 0)) << name;
    EXPECT_EQ(m.nodes[4], Eigen::Vector3d(1, 1, 1)) << name;
    ASSERT_EQ(m.tetrahedra.size(), 2u) << name;
    EXPECT_EQ(m.tetrahedra[0], (std::array<Index, 4>{0, 1, 2, 3})) << name;
    EXPECT_EQ(m.tetrahedra[1], (std::array<Index, 4>{1, 4, 2, 3})) << name;
    EXPECT_EQ(m.label, (std::vector<std::uint16_t>{7, 8})) << name;
  }
}

TEST(MeshFile, WhatIsCutOffOrWrongIsRefusedWithFileAndLine) {
  const auto message = [](const std::string& name, const std::string& text) -> std::string {
    try {
      readTetrahedra(name, text);
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return {};
  };
  const auto with = [](std::string text, const std::string& from, const std::string& to) {
    const auto at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    return text.replace(at, from.size(), to);
  };
  EXPECT_NE(message("a.msh", with(kGmsh22, "2.2 0 8", "2.2 1 8")).find("a.msh:2: a binary file"),
            std::string::npos);
  EXPECT_NE(message("a.msh", with(kGmsh22, "2.2 0 8", "3.0 0 8")).find("version 3.0"), std::string::npos);
  EXPECT_NE(message("a.msh", with(kGmsh22, "10 20 30 40", "10 20 30 41")).find("does not exist"),
            std::string::npos);
  EXPECT_NE(message("a.msh", with(kGmsh22, "20 1 0 0", "20 nan 0 0")).find("coordinate"), std::string::npos);
  EXPECT_NE(message("a.msh", with(kGmsh22, "20 1 0 0", "10 1 0 0")).find("twice"), std::string::npos);
  EXPECT_NE(message("a.msh", with(kGmsh22, "$Nodes\n5\n", "$Nodes\n999999999\n")).find("number of nodes"),
            std::string::npos);
  EXPECT_NE(message("c.vtk", with(kVtk, "ASCII", "BINARY")).find("ASCII"), std::string::npos);
  EXPECT_NE(message("c.vtk", with(kVtk, "4 1 4 2 3", "4 1 9 2 3")).find("does not exist"), std::string::npos);
  EXPECT_NE(message("c.stl", kVtk).find("allowed: .msh"), std::string::npos);
  // Cut off anywhere: refused or, where what is missing does not matter, read; never more than that.
  for (const auto& [name, text] : {std::pair{"a.msh", kGmsh22}, std::pair{"b.msh", kGmsh41},
                                   std::pair{"c.vtk", kVtk}, std::pair{"d.vtk", kVtk51}}) {
    std::size_t refused = 0;
    for (std::size_t n = 0; n < text.size(); ++n) refused += message(name, text.substr(0, n)).empty() ? 0 : 1;
    EXPECT_GT(refused, text.size() / 2) << name;
  }
}

TEST(MeshFile, SurfacesComeThroughTheLibraryWithSharedVertices) {
  const std::string obj = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n";
  const std::string stl =
      "solid t\nfacet normal 0 0 -1\nouter loop\nvertex 0 0 0\nvertex 0 1 0\nvertex 1 0 "
      "0\nendloop\nendfacet\n"
      "facet normal 0 -1 0\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 0 1\nendloop\nendfacet\n"
      "facet normal 1 1 1\nouter loop\nvertex 1 0 0\nvertex 0 1 0\nvertex 0 0 1\nendloop\nendfacet\n"
      "facet normal -1 0 0\nouter loop\nvertex 0 1 0\nvertex 0 0 0\nvertex 0 0 "
      "1\nendloop\nendfacet\nendsolid t\n";
  for (const auto& [name, text] : {std::pair{"t.obj", obj}, std::pair{"t.stl", stl}}) {
    const Surface s = readSurface(name, text);
    EXPECT_EQ(s.vertices.size(), 4u) << name;
    EXPECT_EQ(s.triangles.size(), 4u) << name;
    double volume = 0.0;
    for (const auto& t : s.triangles)
      volume += s.vertices[t[0]].dot(s.vertices[t[1]].cross(s.vertices[t[2]])) / 6;
    EXPECT_NEAR(volume, 1.0 / 6.0, 1e-7) << name;
  }
  EXPECT_THROW(readSurface("t.obj", "nothing"), std::invalid_argument);
  EXPECT_THROW(readSurface("t.vtk", obj), std::invalid_argument);
}

}  // namespace
