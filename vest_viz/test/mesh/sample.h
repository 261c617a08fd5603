#pragma once

#include "vest_viz/mesh/store.h"

namespace vest::mesh {

/// A square of four knots with one skin vertex each, two triangles, facing +z; edge 1 m.
inline Object square(const std::string& name) {
  Object o;
  o.name = name;
  o.organ = "tube";
  o.knot_count = 4;
  o.rest_position = {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0};
  o.knot_fixed = {1, 0, 0, 0};
  o.link_knots = {0, 1, 1, 2};
  o.link_alive = {1, 1};
  o.triangles = {0, 1, 2, 0, 2, 3};
  o.triangle_layer = {0, 0};
  o.texture_coordinates = {0, 0, 2, 0, 2, 2, 0, 2};
  o.binding_start = {0, 1, 2, 3, 4};
  o.binding_knots = {0, 1, 2, 3};
  o.binding_weights = {1, 1, 1, 1};
  return o;
}

inline Topology twoSquares() {
  Topology t;
  t.revision = 5;
  t.scene = "sample";
  t.objects = {square("first"), square("second")};
  return t;
}

inline std::vector<float> positionsOf(const Topology& t) {
  std::vector<float> p;
  for (const Object& o : t.objects) p.insert(p.end(), o.rest_position.begin(), o.rest_position.end());
  return p;
}

}  // namespace vest::mesh
