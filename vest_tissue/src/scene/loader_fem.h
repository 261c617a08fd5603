#pragma once

#include <functional>
#include <string>

#include "vest_tissue/scene/description.h"
#include "yaml_reader.h"

namespace vest::scene {

/// Keys of an object with `model: fem`: strain, nodes, tetrahedra, fixed, loads, material.
/// @param read gives the bytes of the file that a value names, and its path
/// @throws std::invalid_argument: file, line, field, value, what is allowed
void readFem(yaml::Map& map, const std::function<std::string(const yaml::Value&, std::string&)>& read,
             Object& object);

}  // namespace vest::scene
