#pragma once

#include <array>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json.hpp>

#include "vest_bringup/exercise/trainees.h"

namespace vest::exercise {

/// A form by which a person rates what was seen: names of its domains, 1 to 5 marks each. Anchor texts are
/// the authors': raters have them at hand.
struct Form {
  std::string_view name;
  std::array<std::string_view, 6> domains;  ///< those behind the last one are empty
};
/// GOALS: Vassiliou et al., Am J Surg 190 (2005) 107. GEARS: Goh et al., J Urol 187 (2012) 247.
inline constexpr std::array<Form, 2> kForms{
    {{"GOALS", {"depth_perception", "bimanual_dexterity", "efficiency", "tissue_handling", "autonomy", ""}},
     {"GEARS",
      {"depth_perception", "bimanual_dexterity", "efficiency", "force_sensitivity", "autonomy",
       "robotic_control"}}}};

/// A rating as it is kept beside scores: an attempt at `FORM EXERCISE`, so that it is in no learning curve;
/// total is the sum of the marks, quality 100 for full marks and 0 for the least.
/// @throws std::invalid_argument: a form that is not known, or marks that do not fit it
inline Attempt ratingOf(const std::string& form, const std::string& exercise, const std::string& rater,
                        const std::vector<int>& marks, const std::string& trainee, const std::string& date) {
  for (const Form& f : kForms) {
    if (f.name != form) continue;
    std::size_t count = 0;
    while (count < f.domains.size() && !f.domains[count].empty()) ++count;
    if (marks.size() != count)
      throw std::invalid_argument("--marks: " + std::to_string(marks.size()) +
                                  " (allowed: " + std::to_string(count) + " marks for " + form + ")");
    Attempt a;
    nlohmann::json j{{"form", form}, {"exercise", exercise}, {"rater", rater}};
    for (std::size_t i = 0; i < count; ++i) {
      if (marks[i] < 1 || marks[i] > 5)
        throw std::invalid_argument("--marks: " + std::to_string(marks[i]) + " (allowed: 1 to 5)");
      j["marks"][std::string(f.domains[i])] = marks[i];
      a.total += marks[i];
    }
    const auto least = static_cast<double>(count);
    a.quality = 100 * (a.total - least) / (4 * least);
    a.trainee = trainee, a.date = date, a.exercise = form + " " + exercise;
    a.input_hash = date + rater;  // two ratings are no copies of each other
    a.json = j.dump(2, ' ', false, nlohmann::json::error_handler_t::replace);
    return a;
  }
  throw std::invalid_argument("--form " + form + ": unknown (allowed: GOALS, GEARS)");
}

}  // namespace vest::exercise
