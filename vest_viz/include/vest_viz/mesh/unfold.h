#pragma once

#include "vest_viz/mesh/store.h"

namespace vest::mesh {

/// Spreads a wall that is seen from inside (a body cavity) on the plane like an orange peel: texture
/// coordinates in metres, starting from an azimuthal equidistant map about the direction `pole` as seen from
/// the middle, then relaxed so that edges get their own length. Even where the peel's middle is, torn only
/// opposite to the pole. Replaces object->texture_coordinates; does nothing to an object without triangles.
/// @param pole unit vector, world
void unfold(Object* object, const float pole[3]);

/// Where the endoscope of a pelvic scene looks: caudal and down (+y, -z), see the scene's source.
constexpr float kPelvicPole[3] = {0.0f, 0.8710f, -0.4913f};

}  // namespace vest::mesh
