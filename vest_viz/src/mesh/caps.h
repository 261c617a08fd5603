#pragma once

#include "vest_viz/mesh/store.h"

namespace vest::mesh {

/// Spreads the texture over faces on which it does not vary: the end of a sheet or of a blunt tube, whose
/// whole face got the coordinates of its rim, would show the rim's vessels as stripes. Each such face gets
/// vertices of its own (appended to skin->doubled), whose coordinates go on across it in true length. Nothing
/// else changes.
/// @param skin with the triangles and coordinates of the object
void spreadCaps(const Object& object, Skin* skin);

}  // namespace vest::mesh
