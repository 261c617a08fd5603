#pragma once

#include <string>
#include <vector>

#include "vest_bringup/data/run_program.h"

namespace vest::tools {

/// Runs `vest_render` of vest_viz on a bag. @return whether it succeeded
inline bool render(const std::string& bag, const std::vector<std::string>& options) {
  std::vector<std::string> words{"rosrun", "vest_viz", "vest_render", bag};
  words.insert(words.end(), options.begin(), options.end());
  return data::runProgram(std::move(words), "/dev/null", false) == 0;
}

}  // namespace vest::tools
