#pragma once

#include <functional>
#include <string>
#include <vector>

#include "vest_tissue/files/yaml_reader.h"
#include "vest_tissue/material/database.h"
#include "vest_tissue/scene/description.h"

namespace vest::scene {

/// Reads the file that a value names, and says its path.
using ReadFile = std::function<std::string(const yaml::Value&, std::string&)>;

/// The tissue of the database that a value names.
using TissueNamed = std::function<const material::Tissue&(const yaml::Value&)>;

/// Keys of an object with `model: fem` or `model: volume` (docs/scene_format.md).
/// In a World each node belongs to a tetrahedron. Of several tissues the object's own numbers are those of
/// the one that most elements are of. @throws std::invalid_argument: file, line, field, value, what is
/// allowed
/// @return 1/s, per entry of `materials`: blood of the tissue that it names; NaN where it names none. Empty:
/// no `materials`.
std::vector<double> readFem(yaml::Map& map, const ReadFile& read, const TissueNamed& tissue, bool in_world,
                            Object& object);

/// Blood per knot by the labels of the elements about it, by volume.
/// @param perfusion as readFem() gives it
void perfuseByLabel(const std::vector<double>& perfusion, Object& object);

}  // namespace vest::scene
