#include "vest_tissue/net/skin.h"

#include <cmath>
#include <initializer_list>

namespace vest::net {

void rebuildSkin(const float* knots, const std::uint32_t* binding_start, const std::uint32_t* binding_knots,
                 const float* binding_weights, std::size_t vertices, float* out) {
  for (std::size_t v = 0; v < vertices; ++v) {
    float x = 0.0f, y = 0.0f, z = 0.0f;
    for (std::uint32_t e = binding_start[v]; e < binding_start[v + 1]; ++e) {
      const float* knot = knots + 3 * static_cast<std::size_t>(binding_knots[e]);
      const float weight = binding_weights[e];
      x += weight * knot[0];
      y += weight * knot[1];
      z += weight * knot[2];
    }
    out[3 * v] = x;
    out[3 * v + 1] = y;
    out[3 * v + 2] = z;
  }
}

void vertexNormals(const float* positions, std::size_t vertices, const std::uint32_t* triangles,
                   std::size_t count, float* normals) {
  for (std::size_t i = 0; i < 3 * vertices; ++i) normals[i] = 0.0f;
  for (std::size_t t = 0; t < count; ++t) {
    const std::size_t ia = 3 * static_cast<std::size_t>(triangles[3 * t]);
    const std::size_t ib = 3 * static_cast<std::size_t>(triangles[3 * t + 1]);
    const std::size_t ic = 3 * static_cast<std::size_t>(triangles[3 * t + 2]);
    const float ux = positions[ib] - positions[ia], uy = positions[ib + 1] - positions[ia + 1],
                uz = positions[ib + 2] - positions[ia + 2];
    const float wx = positions[ic] - positions[ia], wy = positions[ic + 1] - positions[ia + 1],
                wz = positions[ic + 2] - positions[ia + 2];
    // The cross product's length is twice the area: summing it weighs by area.
    const float nx = uy * wz - uz * wy, ny = uz * wx - ux * wz, nz = ux * wy - uy * wx;
    for (const std::size_t i : {ia, ib, ic}) {
      normals[i] += nx;
      normals[i + 1] += ny;
      normals[i + 2] += nz;
    }
  }
  for (std::size_t v = 0; v < vertices; ++v) {
    float* n = normals + 3 * v;
    const float squared = n[0] * n[0] + n[1] * n[1] + n[2] * n[2];
    if (squared > 1e-30f) {
      const float scale = 1.0f / std::sqrt(squared);
      n[0] *= scale;
      n[1] *= scale;
      n[2] *= scale;
    } else {
      n[0] = n[1] = 0.0f;
      n[2] = 1.0f;
    }
  }
}

}  // namespace vest::net
