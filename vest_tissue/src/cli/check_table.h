#pragma once

#include <string>
#include <vector>

#include "vest_tissue/scene/description.h"

namespace vest::tools {

/// Prints one line per object, the sums, and which knots are inside another object. Good is a scene in which
/// every object is in one piece, without double links, with every knot in the skin's binding, and none falls.
/// @returns what is not good, or nothing
std::string printCheck(const scene::Description& description);

/// Whether a scene can be built and goes 0.2 s without a FAULT and without being thrown about (as its
/// integrator says). @returns why not, or nothing
std::string startFault(const scene::Description& description);

/// The last line, and the only one that judges. @param faults empty ones are none @returns whether it says
/// good
bool printVerdict(const std::vector<std::string>& faults);

/// data/materials.yaml of this package: in the source, or where it was installed.
std::string defaultMaterials();

}  // namespace vest::tools
