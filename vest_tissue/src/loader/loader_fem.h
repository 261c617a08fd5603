#pragma once

#include <functional>
#include <string>

#include "vest_tissue/files/yaml_reader.h"
#include "vest_tissue/scene/description.h"

namespace vest::scene {

/// Reads the file that a value names, and says its path.
using ReadFile = std::function<std::string(const yaml::Value&, std::string&)>;

/// Keys of an object with `model: fem` or `model: volume` (docs/scene_format.md).
/// In a World each node belongs to a tetrahedron. @throws std::invalid_argument: file, line, field, value,
/// what is allowed
void readFem(yaml::Map& map, const ReadFile& read, bool in_world, Object& object);

}  // namespace vest::scene
