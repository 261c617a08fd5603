#pragma once

#include <string>
#include <utility>
#include <vector>

#include "vest_tissue/scene/description.h"

namespace vest::scene {

/// Every file that makes a scene, as it was read: kept with a recording, it is the scene on any machine.
struct SceneFiles {
  /// Paths below the scene's folder with their bytes; the scene file is the first. A scene with sutures has
  /// kSuturesFile among them.
  std::vector<std::pair<std::string, std::string>> files;
  std::string materials;  ///< bytes of the database of materials; empty: the scene refers to none
};

/// The name of the database of sutures: no path below a folder.
inline constexpr const char* kSuturesFile = "/sutures.yaml";

/// loadScene(), and the files that it read. @throws what loadScene() throws
Description loadScene(const std::string& path, SceneFiles& files);

/// Writes them below a folder that is there. Databases become FOLDER/database/materials.yaml and
/// sutures.yaml, which $VEST_TISSUE_DATA has to name (material::databasePath()). @return path of the scene
/// file
/// @throws std::invalid_argument naming a path that leaves the folder, or a file that cannot be written
std::string writeSceneFiles(const SceneFiles& files, const std::string& folder);

}  // namespace vest::scene
