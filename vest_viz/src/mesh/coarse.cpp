#include "vest_viz/mesh/coarse.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>
#include <OpenMesh/Tools/Decimater/DecimaterT.hh>
#include <OpenMesh/Tools/Decimater/ModEdgeLengthT.hh>
#include <OpenMesh/Tools/Decimater/ModHausdorffT.hh>
#include <OpenMesh/Tools/Decimater/ModNormalDeviationT.hh>
#include <OpenMesh/Tools/Decimater/ModQuadricT.hh>

#include "vest_tissue/base/nearest.h"

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

/// A triangle of the coarse surface, and the ball that it lies in.
struct CoarsePatch {
  std::array<std::uint32_t, 3> corners;
  std::array<Eigen::Vector3d, 3> at;
  Eigen::Vector3d middle;
  double reach;  // m
};

/// Vertices at sharp edges and those next to them stay: the normal there turns within one triangle, and would
/// darken the whole width of a larger one.
void lockCrests(Mesh* mesh) {
  const double crest = std::cos(2 * static_cast<double>(kGreatestTurn) * 3.14159265358979 / 180);
  for (const auto e : mesh->edges()) {
    const auto h = mesh->halfedge_handle(e, 0);
    if (mesh->is_boundary(e) ||
        (mesh->normal(mesh->face_handle(h)) | mesh->normal(mesh->opposite_face_handle(h))) > crest)
      continue;
    for (const auto v : {mesh->from_vertex_handle(h), mesh->to_vertex_handle(h)}) {
      mesh->status(v).set_locked(true);
      for (const auto next : mesh->vv_range(v)) mesh->status(next).set_locked(true);
    }
  }
}

}  // namespace

std::vector<std::uint32_t> coarseTriangles(const std::vector<float>& positions,
                                           const std::vector<std::uint32_t>& triangles, double tolerance,
                                           std::size_t kept_from) {
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
    if (mesh.is_boundary(v) || static_cast<std::size_t>(v.idx()) >= kept_from)
      mesh.status(v).set_locked(true);
  mesh.update_face_normals();
  lockCrests(&mesh);
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

std::vector<LeftOut> leftOut(const std::vector<float>& positions, const std::vector<std::uint32_t>& triangles,
                             const std::vector<std::uint32_t>& coarse, const std::atomic<bool>* stop) {
  const auto at = [&](std::uint32_t v) {
    return Eigen::Vector3d(positions[3 * v], positions[3 * v + 1], positions[3 * v + 2]);
  };
  std::vector<bool> open(positions.size() / 3, false);
  for (const std::uint32_t v : triangles) open[v] = true;
  for (const std::uint32_t v : coarse) open[v] = false;
  std::vector<CoarsePatch> patches;
  for (std::size_t t = 0; t + 2 < coarse.size(); t += 3) {
    CoarsePatch p{{coarse[t], coarse[t + 1], coarse[t + 2]}, {}, Eigen::Vector3d::Zero(), 0.0};
    for (std::size_t k = 0; k < 3; ++k) p.at[k] = at(p.corners[k]), p.middle += p.at[k] / 3.0;
    for (const Eigen::Vector3d& corner : p.at) p.reach = std::max(p.reach, (corner - p.middle).norm());
    patches.push_back(p);
  }
  std::vector<LeftOut> result;
  for (std::uint32_t v = 0; v < open.size() && !patches.empty() && !(stop != nullptr && *stop); ++v) {
    if (!open[v]) continue;
    const Eigen::Vector3d place = at(v);
    double least = std::numeric_limits<double>::infinity();
    LeftOut found{v, {}, {}};
    for (const CoarsePatch& p : patches) {
      if ((place - p.middle).norm() - p.reach >= least) continue;
      const contact::Nearest n = contact::nearest(place, p.at);
      if (n.distance >= least) continue;
      least = n.distance;
      found.corners = p.corners;
      for (std::size_t k = 0; k < 3; ++k) found.weights[k] = static_cast<float>(n.weights[k]);
    }
    result.push_back(found);
  }
  return result;
}

std::vector<float> coarseValues(const std::vector<LeftOut>& left_out, const std::vector<float>& values) {
  if (values.empty()) return values;
  std::vector<float> sum = values, weight(values.size(), 1.0f);
  for (const LeftOut& l : left_out)
    for (std::size_t k = 0; k < 3; ++k) {
      sum[l.corners[k]] += l.weights[k] * values[l.vertex];
      weight[l.corners[k]] += l.weights[k];
    }
  for (std::size_t v = 0; v < values.size(); ++v) sum[v] /= weight[v];
  return sum;
}

float greatestGap(const std::vector<LeftOut>& left_out, const std::vector<float>& positions) {
  float greatest = 0.0f;
  for (const LeftOut& l : left_out) {
    float square = 0.0f;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      float gap = positions[3 * l.vertex + axis];
      for (std::size_t k = 0; k < 3; ++k) gap -= l.weights[k] * positions[3 * l.corners[k] + axis];
      square += gap * gap;
    }
    greatest = std::max(greatest, square);
  }
  return std::sqrt(greatest);
}

}  // namespace vest::mesh
