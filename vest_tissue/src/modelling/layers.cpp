#include "vest_tissue/modelling/layers.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <stdexcept>

#include <Eigen/Geometry>

namespace vest::modelling {
namespace {

constexpr double kLeastShare = 0.2;  // of an edge on the inner side: a wall of 0.8 of the radius leaves it

std::vector<Vector3> normalsOf(const std::vector<Vector3>& surface,
                               const std::vector<std::array<std::uint32_t, 3>>& triangles) {
  std::vector<Vector3> normals(surface.size(), Vector3::Zero());
  for (const auto& t : triangles) {
    const Vector3 face = (surface[t[1]] - surface[t[0]]).cross(surface[t[2]] - surface[t[0]]).normalized();
    for (int k = 0; k < 3; ++k) {
      const Vector3 a = (surface[t[(k + 1) % 3]] - surface[t[k]]).normalized(),
                    b = (surface[t[(k + 2) % 3]] - surface[t[k]]).normalized();
      normals[t[k]] += std::acos(std::clamp(a.dot(b), -1.0, 1.0)) * face;
    }
  }
  for (Vector3& normal : normals) normal.normalize();
  return normals;
}

double sixfold(const Vector3& a, const Vector3& b, const Vector3& c, const Vector3& d) {
  return (b - a).dot((c - a).cross(d - a));
}

[[noreturn]] void tooThick(const Vector3& place, double thickness) {
  char text[200];
  std::snprintf(
      text, sizeof text,
      "layers of %.4g m are too thick for the curvature at [%.4g, %.4g, %.4g]; allowed: thinner, at "
      "most 0.8 of the radius there",
      thickness, place.x(), place.y(), place.z());
  throw std::invalid_argument(text);
}

}  // namespace

LayeredMesh makeLayers(const std::vector<Vector3>& surface,
                       const std::vector<std::array<std::uint32_t, 3>>& triangles,
                       const std::vector<Layer>& layers) {
  const std::vector<Vector3> normals = normalsOf(surface, triangles);
  LayeredMesh mesh;
  mesh.nodes = surface;
  double depth = 0;
  std::uint32_t levels = 0;
  for (std::size_t l = 0; l < layers.size(); ++l) {
    for (std::uint32_t e = 0; e < layers[l].elements; ++e) {
      const double next = depth + layers[l].thickness * (e + 1) / layers[l].elements;
      for (std::size_t i = 0; i < surface.size(); ++i) mesh.nodes.push_back(surface[i] - next * normals[i]);
      const auto above = static_cast<std::uint32_t>(surface.size()) * levels;
      const auto below = above + static_cast<std::uint32_t>(surface.size());
      for (const auto& t : triangles) {
        std::array<std::uint32_t, 3> s = t;
        std::sort(s.begin(), s.end());
        const auto& x = mesh.nodes;
        for (int k = 0; k < 3; ++k) {
          const Vector3 outer = surface[t[(k + 1) % 3]] - surface[t[k]],
                        inner = x[below + t[(k + 1) % 3]] - x[below + t[k]];
          if (!(inner.dot(outer) >= kLeastShare * outer.squaredNorm())) tooThick(surface[t[k]], next);
        }
        for (std::array<std::uint32_t, 4> corners :
             {std::array<std::uint32_t, 4>{below + s[0], below + s[1], below + s[2], above + s[2]},
              {below + s[0], below + s[1], above + s[2], above + s[1]},
              {below + s[0], above + s[0], above + s[1], above + s[2]}}) {
          double volume = sixfold(x[corners[0]], x[corners[1]], x[corners[2]], x[corners[3]]);
          // The three of a prism lean to one side or the other as its points are numbered.
          const bool even = (s[0] == t[0] && s[1] == t[1]) || (s[0] == t[1] && s[1] == t[2]) ||
                            (s[0] == t[2] && s[1] == t[0]);
          if (!even) {
            std::swap(corners[2], corners[3]);
            volume = -volume;
          }
          if (!(volume > 0)) tooThick(surface[t[0]], next);
          mesh.tetrahedra.push_back(corners);
          mesh.layer.push_back(static_cast<std::uint16_t>(l));
        }
      }
      ++levels;
    }
    depth += layers[l].thickness;
  }
  return mesh;
}

std::string meshText(const std::vector<Vector3>& nodes,
                     const std::vector<std::array<std::uint32_t, 4>>& tetrahedra,
                     const std::vector<std::uint16_t>& group) {
  std::string text = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n" + std::to_string(nodes.size()) + "\n";
  char line[160];
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    std::snprintf(line, sizeof line, "%zu %.17g %.17g %.17g\n", i + 1, nodes[i].x(), nodes[i].y(),
                  nodes[i].z());
    text += line;
  }
  text += "$EndNodes\n$Elements\n" + std::to_string(tetrahedra.size()) + "\n";
  for (std::size_t i = 0; i < tetrahedra.size(); ++i) {
    const auto& t = tetrahedra[i];
    const unsigned label = group[i] + 1u;
    std::snprintf(line, sizeof line, "%zu 4 2 %u %u %u %u %u %u\n", i + 1, label, label, t[0] + 1, t[1] + 1,
                  t[2] + 1, t[3] + 1);
    text += line;
  }
  return text + "$EndElements\n";
}

}  // namespace vest::modelling
