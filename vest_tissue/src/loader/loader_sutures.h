#pragma once

#include "vest_tissue/files/yaml_reader.h"
#include "vest_tissue/material/sutures.h"
#include "vest_tissue/scene/description.h"

/// Sutures of a scene (docs/scene_format.md).
namespace vest::scene {

/// Keys material and size of a map: what the shipped sutures.yaml says of that thread.
Suture readSutureKind(yaml::Map& map, const material::Sutures& known);
/// The list `sutures:`, none of which is named as one of `taken`. @throws std::invalid_argument
std::vector<Suture> readSutures(const yaml::Value& list, const material::Sutures& known,
                                const std::vector<std::string>& taken);
/// The same as it is written into a scene file; empty where there are none.
std::string suturesText(const std::vector<Suture>& sutures);

}  // namespace vest::scene
