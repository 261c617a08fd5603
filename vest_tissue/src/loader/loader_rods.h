#pragma once

#include "side_files.h"
#include "vest_tissue/files/yaml_reader.h"
#include "vest_tissue/scene/description.h"
#include "vest_tissue/suture/description.h"

/// Rods and cylinders of a scene (docs/scene_format.md).
namespace vest::scene {

bool isRodOrCylinder(const Value& object);

/// An object of that kind, behind those that are there. @throws std::invalid_argument
void readRodOrCylinder(const Value& object, Files& files, suture::Description& objects);

/// Reads a scene in which there are rods and cylinders beside other objects. @throws std::invalid_argument
/// @param equilibrium whether it asks for `integrator: static`
Description loadTogether(const std::string& path, suture::Description& rods, bool& equilibrium);

}  // namespace vest::scene
