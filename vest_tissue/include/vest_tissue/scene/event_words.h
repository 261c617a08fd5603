#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

/// Words of what happens to tissue.
namespace vest::scene {

/// Of EventKind, and so of vest_msgs/TissueEvent, in their order; for people.
inline constexpr std::array<std::string_view, 18> kEventWords{
    "grasped",    "released",  "slipped", "cut",      "clipped",   "unclipped",
    "coagulated", "punctured", "ligated", "torn",     "knot tied", "perforated",
    "separated",  "fault",     "exited",  "torn out", "suspended", "unsuspended"};

/// The same as files have it: one word each. "unknown" beyond the last.
inline std::string eventKey(std::size_t kind) {
  std::string word(kind < kEventWords.size() ? kEventWords[kind] : "unknown");
  std::replace(word.begin(), word.end(), ' ', '_');
  return word;
}
inline std::vector<std::string> eventKeys() {
  std::vector<std::string> keys;
  for (std::size_t i = 0; i < kEventWords.size(); ++i) keys.push_back(eventKey(i));
  return keys;
}

}  // namespace vest::scene
