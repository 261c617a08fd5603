#pragma once

#include "vest_viz/instrument/stl.h"

namespace vest::instrument {

/// The same jaw with the grooves between its teeth filled: what a pixel as large as a tooth shows of a jaw.
/// With teeth such a pixel meets a crest or a groove by chance, and the closed jaws have a seam of dots.
/// Vertices nearer to the plane x = 0, where jaws meet, than make_meshes.cpp cuts teeth are moved along x to
/// the crest beside them. Vertices and triangles keep their order.
/// @param jaw m, in a jaw's frame: z along it, x the opening
TriangleMesh toothless(const TriangleMesh& jaw);

/// The mesh between the two. @param share of the teeth, 0 … 1
TriangleMesh between(const TriangleMesh& toothless, const TriangleMesh& whole, float share);

/// Share of the teeth to be drawn: all where a tooth is six pixels long or more, none at three.
/// @param pixel m, at the jaw, across the view
float teethShown(double pixel);

}  // namespace vest::instrument
