#pragma once

#include <cstdint>

#include "vest_tissue/scene/description.h"

namespace vest::scene {

/// XXH64 over all that a scene says of an object, without the place where it begins (Object::position): two
/// objects with the same number are built to the same tissue.
std::uint64_t identityOf(const Object& object);
/// The same of a suture: whole, with where it begins.
std::uint64_t identityOf(const Suture& suture);

}  // namespace vest::scene
