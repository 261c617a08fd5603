#pragma once

#include <string>

#include "vest_tissue/scene/description.h"

namespace vest::tools {

/// Prints one line per object, the sums, and which knots are inside another object; returns whether every
/// object is in one piece, without double links, with every knot in the skin's binding, and none falls.
bool printCheck(const scene::Description& description);

/// Whether a scene can be built and goes 0.2 s without a FAULT and without being thrown about (as its
/// integrator says). Prints why not.
bool startsWell(const scene::Description& description);

/// data/materials.yaml of this package: in the source, or where it was installed.
std::string defaultMaterials();

}  // namespace vest::tools
