/// A scene in which a patient's images are felt (docs/haptics/voxels.md).
#pragma once

#include <functional>
#include <string>

#include "vest_tissue/image/volume.h"

namespace vest::image {

/// Writes NAME.yaml, NAME.raw and needle.csv into a folder that is there; NAME is the folder's. The patient
/// lies supine; the highest tissue over the middle of the box stands at z = 0.115 m, below the trocars.
/// @param table CSV with columns for the hand; empty: the shipped one, for values in HU
/// @param check is given the scene before the three files take their places: where it throws, none of them
/// does
/// @return path of the scene @throws std::invalid_argument: values without a unit and no table, nothing but
/// air, a name that a scene cannot have, cannot be written
std::string writeFeltScene(const Volume& volume, const std::string& folder, const std::string& table = "",
                           const std::function<void(const std::string& scene)>& check = {});

}  // namespace vest::image
