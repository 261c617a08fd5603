#pragma once

#include "vest_bringup/vest.h"
#include "vest_tissue/scene/world.h"

namespace vest::learning {

/// What vest.h tells of a step, for a World. @throws std::invalid_argument: field, value, what is allowed
void read(const vest_input& from, const scene::World& world, scene::StepInput& to);

}  // namespace vest::learning
