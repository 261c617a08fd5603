#pragma once

#include <string>

#include "vest_tissue/scene/world_model.h"

namespace vest::scene::snapshot {

/// @throws std::invalid_argument "snapshot: WHAT"
[[noreturn]] void refuse(const std::string& what);

/// Everything by which a State that a file brought could lead a step out of its arrays or out of bounded
/// work: indices, lists that belong together, places, speeds, counts. @throws std::invalid_argument
void check(const WorldState& state, const WorldModel& model);

}  // namespace vest::scene::snapshot
