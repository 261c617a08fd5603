#pragma once

#include <string>

#include "vest_tissue/modelling/source.h"

namespace vest::modelling {

/// Files of the source's own parts, from its folder into that of its scene, which then holds what it was made
/// from.
/// @throws std::runtime_error, std::filesystem::filesystem_error; where a folder below `to` is a link, too
void copyParts(const SceneSource& source, const std::string& from, const std::string& to);

}  // namespace vest::modelling
