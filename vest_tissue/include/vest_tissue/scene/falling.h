#pragma once

#include <string>
#include <vector>

#include "vest_tissue/scene/description.h"

namespace vest::scene {

/// Objects, by index, that would fall for ever: nothing holds them (no fixed knot, no tether, no connection
/// to what is held), and along gravity nothing lies below any of their knots that is rigid, held or lies on
/// such. In the positions of the start. Empty without gravity, and where a second of looking does not tell.
std::vector<std::size_t> fallingObjects(const Description& description);

/// One sentence that names them and says what to do; empty if none falls.
std::string fallingSentence(const Description& description);

}  // namespace vest::scene
