#pragma once

#include <string>

#include "vest_viz/texture/organ_texture.h"

namespace vest::texture {

/// bake(), or what an earlier call left in the folder: baking takes seconds at every start otherwise.
/// @param directory of vest_tissue/cache/block.h; empty: nothing is kept
Baked bakeKept(const Style& style, int size, std::uint32_t seed, const std::string& directory);

}  // namespace vest::texture
