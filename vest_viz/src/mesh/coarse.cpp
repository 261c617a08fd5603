#include "vest_viz/mesh/coarse.h"

#include <cmath>

#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>
#include <OpenMesh/Tools/Decimater/DecimaterT.hh>
#include <OpenMesh/Tools/Decimater/ModEdgeLengthT.hh>
#include <OpenMesh/Tools/Decimater/ModHausdorffT.hh>
#include <OpenMesh/Tools/Decimater/ModNormalDeviationT.hh>
#include <OpenMesh/Tools/Decimater/ModQuadricT.hh>

namespace vest::mesh {
namespace {

struct Traits : OpenMesh::DefaultTraits {
  using Point = OpenMesh::Vec3d;  // squared millimetres are lost in single precision
  using Normal = OpenMesh::Vec3d;
  VertexAttributes(OpenMesh::Attributes::Status);
  EdgeAttributes(OpenMesh::Attributes::Status);
  FaceAttributes(OpenMesh::Attributes::Status | OpenMesh::Attributes::Normal);
};
using Mesh = OpenMesh::TriMesh_ArrayKernelT<Traits>;

// m: longer edges stay. Light is computed at the vertices, and falls off within some centimetres.
constexpr float kLongestCollapse = 0.004f;
constexpr float kGreatestTurn = 20.0f;  // degrees; by eye, beyond it shading changes

}  // namespace

std::vector<std::uint32_t> coarseTriangles(const std::vector<float>& positions,
                                           const std::vector<std::uint32_t>& triangles, double tolerance) {
  omerr().disable();  // what is no surface is answered, not printed
  Mesh mesh;
  std::vector<Mesh::VertexHandle> vertex(positions.size() / 3);
  for (std::size_t v = 0; v < vertex.size(); ++v)
    vertex[v] = mesh.add_vertex({positions[3 * v], positions[3 * v + 1], positions[3 * v + 2]});
  for (std::size_t t = 0; t + 2 < triangles.size(); t += 3) {
    const std::uint32_t a = triangles[t], b = triangles[t + 1], c = triangles[t + 2];
    if (a == b || b == c || a == c) continue;
    if (!mesh.add_face(vertex[a], vertex[b], vertex[c]).is_valid()) return triangles;
  }
  for (const auto v : mesh.vertices())
    if (mesh.is_boundary(v)) mesh.status(v).set_locked(true);
  mesh.update_face_normals();
  OpenMesh::Decimater::DecimaterT<Mesh> decimater(mesh);
  OpenMesh::Decimater::ModQuadricT<Mesh>::Handle quadric;
  OpenMesh::Decimater::ModNormalDeviationT<Mesh>::Handle turn;
  OpenMesh::Decimater::ModHausdorffT<Mesh>::Handle distance;
  OpenMesh::Decimater::ModEdgeLengthT<Mesh>::Handle length;
  if (!decimater.add(length) || !decimater.add(quadric) || !decimater.add(turn) || !decimater.add(distance))
    return triangles;
  decimater.module(quadric).unset_max_err();  // the order of collapses; the next one says how far
  decimater.module(distance).set_tolerance(tolerance);
  decimater.module(length).set_edge_length(kLongestCollapse);
  decimater.module(turn).set_normal_deviation(kGreatestTurn);
  if (!decimater.initialize()) return triangles;
  decimater.decimate();
  std::vector<std::uint32_t> out;
  for (const auto f : mesh.faces())
    for (const auto v : mesh.fv_range(f)) out.push_back(static_cast<std::uint32_t>(v.idx()));
  return out;
}

}  // namespace vest::mesh
