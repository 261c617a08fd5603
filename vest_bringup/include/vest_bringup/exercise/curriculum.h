#pragma once

#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "vest_bringup/exercise/trainees.h"
#include "vest_instruments/files/strict_json.h"

namespace vest::exercise {

/// Exercises that a trainee shall learn, in this order.
inline constexpr const char* kCurriculum = "curriculum";
/// Passes in a row that an exercise of it takes: two, as FLS tasks do in Ritter & Scott, Surg Innov 14 (2007)
/// 107. Attempts with a flag neither count nor break a row.
inline constexpr int kPassesInARow = 2;

/// A curriculum as it is kept beside scores: an attempt at `curriculum`, so that it is in no learning curve,
/// is exported and erased with them. The newest holds.
inline Attempt curriculumOf(const std::vector<std::string>& exercises, const std::string& trainee,
                            const std::string& date) {
  Attempt a;
  a.trainee = trainee, a.date = date, a.exercise = kCurriculum;
  a.json =
      nlohmann::json{{"exercises", exercises}}.dump(2, ' ', false, nlohmann::json::error_handler_t::replace);
  a.input_hash = date + trainee + a.json;  // the same for two is no copy
  return a;
}

struct CurriculumStep {
  std::string exercise;
  std::size_t attempts = 0;  ///< those without a flag
  bool done = false;         ///< passed kPassesInARow times in a row, whenever that was
};

/// How far a trainee is. @param attempts all of the trainee, oldest first
/// @return empty where there is no curriculum  @throws DatabaseError where the kept one cannot be read
inline std::vector<CurriculumStep> curriculumSteps(const std::vector<Attempt>& attempts) {
  std::vector<CurriculumStep> steps;
  for (const Attempt& a : attempts) {
    if (a.exercise != kCurriculum) continue;
    steps.clear();
    try {
      const nlohmann::json kept = files::parseJson(a.json);
      for (const auto& name : kept.at("exercises")) steps.push_back({name.get<std::string>(), 0, false});
    } catch (const std::exception& why) {
      throw DatabaseError("curriculum of " + a.date + ": json: " + why.what());
    }
  }
  for (CurriculumStep& step : steps) {
    int row = 0;
    for (const Attempt& a : attempts) {
      if (a.exercise != step.exercise || !a.flags.empty()) continue;
      ++step.attempts;
      row = a.passed ? row + 1 : 0;
      step.done = step.done || row >= kPassesInARow;
    }
  }
  return steps;
}

}  // namespace vest::exercise
