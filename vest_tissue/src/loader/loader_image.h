#pragma once

#include "loader_fem.h"

namespace vest::scene {

/// `image:` of a scene: a patient's image that tools feel, and its regions, which become objects behind those
/// that are there (docs/scene_format.md). @throws std::invalid_argument: file, line, field, value, what is
/// allowed
void readFeltImage(const yaml::Value& value, const ReadFile& read, Description& description);

}  // namespace vest::scene
