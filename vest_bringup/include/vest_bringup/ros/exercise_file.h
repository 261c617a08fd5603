#pragma once

#include <algorithm>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <vector>

#include <ros/package.h>

#include "vest_bringup/exercise/trainees.h"

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

/// File of an exercise that is given as users give it: a name, or the path of a file.
/// @throws std::invalid_argument where no exercise has this name; says which there are
inline std::string exerciseFile(const std::string& exercise) {
  if (exercise::isExerciseFile(exercise)) return exercise;
  std::string allowed;
  for (const std::string& name : exerciseNames()) {
    if (name == exercise)
      return ros::package::getPath("vest_bringup") + "/exercises/" + name + "/exercise.yaml";
    allowed += name + ", ";
  }
  throw std::invalid_argument("exercise '" + exercise + "': unknown (allowed: " + allowed +
                              "or the path of an exercise file)");
}

/// What is kept of a result. A file that has the name of an exercise that VEST brings, and other marks,
/// scores something else: the attempt has the flag `other version`, and counts for no learning curve.
inline exercise::Attempt attemptOf(const exercise::Exercise& e, const exercise::Result& result,
                                   const std::string& trainee, const std::string& date,
                                   const std::string& version, const std::string& directory) {
  exercise::Attempt attempt = exercise::attemptOf(e, result, trainee, date, version, directory);
  for (const std::string& name : exerciseNames())
    if (name == e.name && exercise::loadExercise(exerciseFile(name)).hash != e.hash)
      attempt.flags += attempt.flags.empty() ? "other version" : ",other version";
  return attempt;
}

}  // namespace vest::ros_shell
