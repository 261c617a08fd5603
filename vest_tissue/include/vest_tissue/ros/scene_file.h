#pragma once

#include <algorithm>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <vector>

#include <ros/package.h>

namespace vest::ros_shell {

/// File of a scene that is given as users give it: a name under scenes/ of vest_tissue, or the path of a
/// scene file (it has a slash, or ends in .yaml).
/// @throws std::invalid_argument where no scene has this name; says which there are
inline std::string sceneFile(const std::string& scene) {
  namespace fs = std::filesystem;
  if (scene.find('/') != std::string::npos || fs::path(scene).extension() == ".yaml") return scene;
  const fs::path package = ros::package::getPath("vest_tissue");
  if (package.empty())
    throw std::invalid_argument("scene '" + scene + "': package vest_tissue is not on ROS_PACKAGE_PATH");
  const auto file = [&](const std::string& name) { return package / "scenes" / name / (name + ".yaml"); };
  std::error_code error;
  if (!scene.empty() && fs::exists(file(scene), error)) return file(scene);
  std::vector<std::string> names;
  for (const auto& entry : fs::directory_iterator(package / "scenes", error)) {
    const std::string name = entry.path().filename();
    if (fs::exists(file(name), error)) names.push_back(name);
  }
  std::sort(names.begin(), names.end());
  std::string allowed;
  for (const std::string& name : names) allowed += name + ", ";
  throw std::invalid_argument("scene '" + scene + "': unknown (allowed: " + allowed +
                              "or the path of a scene file)");
}

}  // namespace vest::ros_shell
