#pragma once

#include "vest_tissue/files/yaml_reader.h"
#include "vest_tissue/scene/description.h"

/// Keys of an object that make it live: what tears, cuts and crushes it, heat, motility; and connections by
/// nearest neighbour (docs/scene_format.md).
namespace vest::scene {

/// motility: {preset: WORD, radial: {…}, axial: {…}, ramp: S}. @throws std::invalid_argument
motility::Motility readMotility(const yaml::Value& value);
/// `motility:` as it is written into a scene file, one line; empty where there is none.
std::string motilityText(const motility::Motility& motility);
/// What readLiving() reads but for motility, as lines of an object: all that its tissue's name gives it.
std::string livingText(const Object& object);
/// Keys friction, cut_toughness, tear_strain, grasp_damage_threshold, thermal and motility of an object.
/// @throws std::invalid_argument
void readLiving(yaml::Map& map, Object& object);
/// Ties each knot of the first object to the nearest place on the second one's surface, within a distance.
/// @throws std::invalid_argument
void readNearestConnections(const yaml::Value& value, Description& description);

}  // namespace vest::scene
