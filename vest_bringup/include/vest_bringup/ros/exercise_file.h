#pragma once

#include <algorithm>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <vector>

#include <ros/package.h>

namespace vest::ros_shell {

/// Names of the exercises that VEST brings, sorted: folders under exercises/ of vest_bringup.
inline std::vector<std::string> exerciseNames() {
  namespace fs = std::filesystem;
  std::vector<std::string> names;
  std::error_code error;
  for (const auto& entry :
       fs::directory_iterator(ros::package::getPath("vest_bringup") + "/exercises", error))
    if (fs::exists(entry.path() / "exercise.yaml", error)) names.push_back(entry.path().filename());
  std::sort(names.begin(), names.end());
  return names;
}

/// File of an exercise that is given as users give it: a name, or the path of a file (it has a slash, or ends
/// in .yaml). @throws std::invalid_argument where no exercise has this name; says which there are
inline std::string exerciseFile(const std::string& exercise) {
  if (exercise.find('/') != std::string::npos || std::filesystem::path(exercise).extension() == ".yaml")
    return exercise;
  std::string allowed;
  for (const std::string& name : exerciseNames()) {
    if (name == exercise)
      return ros::package::getPath("vest_bringup") + "/exercises/" + name + "/exercise.yaml";
    allowed += name + ", ";
  }
  throw std::invalid_argument("exercise '" + exercise + "': unknown (allowed: " + allowed +
                              "or the path of an exercise file)");
}

}  // namespace vest::ros_shell
