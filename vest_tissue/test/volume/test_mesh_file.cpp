// Mesh files: the same two tetrahedra in each format, and what is broken is refused.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <initializer_list>
#include <string>

#include <Eigen/Geometry>

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
  EXPECT_NE(message("a.msh", with(kGmsh22, "10 20 30 40", "10 20 30 41"))
                .find("node 41, which does not exist; allowed: a tag of $Nodes"),
            std::string::npos);
  EXPECT_NE(message("a.msh", with(kGmsh22, "20 1 0 0", "20 nan 0 0")).find("coordinate"), std::string::npos);
  EXPECT_NE(message("a.msh", with(kGmsh22, "20 1 0 0", "10 1 0 0")).find("twice"), std::string::npos);
  EXPECT_NE(message("a.msh", with(kGmsh22, "$Nodes\n5\n", "$Nodes\n999999999\n")).find("number of nodes"),
            std::string::npos);
  EXPECT_NE(message("c.vtk", with(kVtk, "ASCII", "BINARY")).find("ASCII"), std::string::npos);
  EXPECT_NE(message("c.vtk", with(kVtk, "4 1 4 2 3", "4 1 9 2 3"))
                .find("point 9, which does not exist; allowed: 0 to"),
            std::string::npos);
  EXPECT_NE(message("c.vtk", kVtk + kVtk.substr(kVtk.find("CELL_TYPES"))).find("CELL_TYPES twice"),
            std::string::npos);
  // A volume that is no tetrahedron would be a hole.
  EXPECT_NE(message("a.msh", with(kGmsh22, "2 4 2 7 1 10 20 30 40", "2 7 2 7 1 10 20 30 40 50"))
                .find("element kind 7"),
            std::string::npos);
  EXPECT_NE(message("c.vtk", with(kVtk, "5\n10\n10", "5\n10\n14")).find("cell type 14"), std::string::npos);
  EXPECT_NE(
      message("a.msh", with(kGmsh22, "$Nodes", "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Nodes")).find("twice"),
      std::string::npos);
  EXPECT_NE(message("c.stl", kVtk).find("allowed: .msh"), std::string::npos);
  // Cut off anywhere: refused or, where what is missing does not matter, read; never more than that.
  for (const auto& [name, text] : {std::pair{"a.msh", kGmsh22}, std::pair{"b.msh", kGmsh41},
                                   std::pair{"c.vtk", kVtk}, std::pair{"d.vtk", kVtk51}}) {
    std::size_t refused = 0;
    for (std::size_t n = 0; n < text.size(); ++n) refused += message(name, text.substr(0, n)).empty() ? 0 : 1;
    EXPECT_GT(refused, text.size() / 2) << name;
  }
}

TEST(MeshFile, SurfacesHaveSharedVertices) {
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

const std::string kPly =
    "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
    "element face 4\nproperty list uchar int vertex_indices\nend_header\n"
    "0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 1 2 3\n3 2 0 3\n";

std::string changed(std::string text, const std::string& from, const std::string& to) {
  const auto at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return at == std::string::npos ? text : text.replace(at, from.size(), to);
}

std::string refusal(const std::string& name, const std::string& text) {
  try {
    readSurface(name, text);
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return {};
}

void says(const std::string& message, std::initializer_list<const char*> parts) {
  for (const char* part : parts)
    EXPECT_NE(message.find(part), std::string::npos) << "'" << part << "' not in: " << message;
}

TEST(SurfaceFile, APlyIsReadAsTextAndInBothByteOrders) {
  EXPECT_EQ(readSurface("t.ply", kPly).triangles.size(), 4u);
  const auto binary = [](bool big) {
    std::string s = changed(kPly.substr(0, kPly.find("end_header\n") + 11), "ascii",
                            big ? "binary_big_endian" : "binary_little_endian");
    const auto put = [&](const void* from, std::size_t size) {
      std::string b(static_cast<const char*>(from), size);
      if (big) std::reverse(b.begin(), b.end());
      s += b;
    };
    for (const float c : {0.f, 0.f, 0.f, 1.f, 0.f, 0.f, 0.f, 1.f, 0.f, 0.f, 0.f, 1.f}) put(&c, sizeof c);
    for (const auto& f :
         {std::array{0, 2, 1}, std::array{0, 1, 3}, std::array{1, 2, 3}, std::array{2, 0, 3}}) {
      s += '\3';
      for (const int k : f) put(&k, sizeof k);
    }
    return s;
  };
  for (const bool big : {false, true}) {
    const Surface s = readSurface("t.ply", binary(big));
    ASSERT_EQ(s.vertices.size(), 4u);
    EXPECT_EQ(s.vertices[3], Eigen::Vector3d(0, 0, 1));
    EXPECT_EQ(s.triangles, readSurface("t.ply", kPly).triangles);
  }
  says(refusal("t.ply", binary(false).substr(0, binary(false).size() - 1)), {"t.ply: ends after"});
  says(refusal("t.ply", binary(false) + "x"), {"t.ply: 1 bytes after the last element"});
}

TEST(SurfaceFile, WhatALibraryReadsBeyondItsEndIsOneMessage) {
  says(refusal("t.ply", changed(kPly, "3 2 0 3", "3 2 0 -3000")), {"t.ply:17: ", "vertex -3000"});
  says(refusal("t.ply", changed(kPly, "3 2 0 3", "3 2 0 4")), {"t.ply:17: ", "vertex 4"});
  says(refusal("t.ply", changed(kPly, "0 0 1\n", "0 0 1\n0 0 1\n")), {"t.ply:", "allowed"});
  says(refusal("t.ply", changed(kPly, "end_header", "end_hgader")), {"t.ply:9: 'end_hgader'"});
  says(refusal("t.ply", changed(kPly, "vertex 4", "vertex 4000000000")), {"t.ply:3: a count of elements"});
  says(refusal("t.ply", changed(kPly, "3 2 0 3", "200 2 0 3")), {"t.ply:17: a list of 200"});
  says(refusal("t.ply", changed(kPly, "0 0 1", "0 0 1e39")), {"t.ply:13: a coordinate of 1e+39"});
  says(refusal("t.ply", changed(kPly, "3 2 0 3", "3 2 2 3")), {"t.ply:17: ", "two corners at one place"});
  for (std::size_t n = 0; n + 1 < kPly.size(); ++n)
    EXPECT_NE(refusal("t.ply", kPly.substr(0, n)), "") << "cut after " << n;
}

TEST(SurfaceFile, EachMistakeInObjAndStlIsNamed) {
  const std::string obj =
      "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1/2 2/1/1 4//3\nf -3 -2 -1\nf 3 1 4\n";
  EXPECT_EQ(readSurface("t.obj", obj).triangles.size(), 4u);
  says(refusal("t.obj", obj + "f 1 2 5\n"), {"t.obj:9: a face names vertex 5"});
  says(refusal("t.obj", obj + "f 1 2 0\n"), {"t.obj:9: '0'"});
  says(refusal("t.obj", obj + "f 1 2 -5\n"), {"t.obj:9: a face names vertex -5"});
  says(refusal("t.obj", obj + "f 1 2\n"), {"t.obj:9: a face of 2 corners"});
  says(refusal("t.obj", obj + "curv 1 2\n"), {"t.obj:9: 'curv'"});
  says(refusal("t.obj", "v 1e39 0 0\n"), {"t.obj:1: a coordinate of 1e+39"});
  says(refusal("t.obj", "v 1 nan 0\n"), {"t.obj:1: a coordinate: 'nan'"});
  const std::string stl =
      "solid\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n";
  EXPECT_EQ(readSurface("t.stl", stl + "endsolid\n").triangles.size(), 1u);
  says(refusal("t.stl", stl), {"t.stl:", "ends within a solid"});
  says(refusal("t.stl", changed(stl, "vertex 1 0 0", "vertex 0 0 0") + "endsolid\n"),
       {"t.stl:8: ", "at one place"});
  says(refusal("t.stl", std::string(80, ' ') + std::string("\1\0\0\0", 4)),
       {"t.stl: 84 bytes; allowed: 134"});
}

TEST(SurfaceFile, PolygonsAreFilledFromWhereTheyTurnInwards) {
  const std::string dart = "v 0 0 0\nv 2 1 0\nv 0 2 0\nv 1 1 0\nf 1 2 3 4\n";
  const Surface s = readSurface("t.obj", dart);
  ASSERT_EQ(s.triangles.size(), 2u);
  for (const auto& t : s.triangles) {
    const Eigen::Vector3d n =
        (s.vertices[t[1]] - s.vertices[t[0]]).cross(s.vertices[t[2]] - s.vertices[t[0]]);
    EXPECT_GT(n.z(), 0) << "no triangle turns over";
  }
  says(refusal("t.obj", "v 0 0 0\nv 2 0 0\nv 1 1 0\nv 2 2 0\nv 0 2 0\nf 1 2 3 4 5\n"), {"not convex"});
}

TEST(MeshFile, AHeaderOfGmsh41MustCountWhatIsThere) {
  const auto message = [](const std::string& text) -> std::string {
    try {
      readTetrahedra("a.msh", text);
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return {};
  };
  says(message(changed(kGmsh41, "2 5 10 50", "2 6 10 50")), {"a.msh:", "counts 6 nodes", "hold 5"});
  says(message(changed(kGmsh41, "3 3 1 3", "3 4 1 3")), {"a.msh:", "counts 4 elements", "hold 3"});
  says(message(changed(kGmsh41, "2 5 10 50", "2 5 10 40")), {"a.msh:", "a node: 50"});
  says(message(changed(kGmsh41, "2 5 10 50", "2 5 10 60")), {"a.msh:", "nodes", "10 to 60", "from 10 to 50"});
  says(message(changed(kGmsh41, "2 5 10 50", "2 5 9 50")), {"a.msh:", "nodes", "9 to 50", "from 10 to 50"});
  says(message(changed(kGmsh41, "3 3 1 3", "3 3 1 7")), {"a.msh:", "elements", "1 to 7", "from 1 to 3"});
  says(message(changed(kGmsh41, "$Elements", "$Nodes\n0 0 1 1\n$EndNodes\n$Elements")), {"$Nodes twice"});
}

}  // namespace
