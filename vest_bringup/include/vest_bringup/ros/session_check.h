#pragma once

#include <string>
#include <vector>

namespace vest::session {

/// A thing that a good session keeps.
struct CheckRow {
  std::string name, value, allowed;
  bool good = false;
};

/// Judges a recorded session: rates, steps and real time from the bag's stamps, and whether session.json is
/// whole, agrees with the bag, and says that the session ended as it was meant to.
/// @param directory with session.bag and session.json  @param ns namespace of the session
/// @param picture whether a view was there
/// @throws std::invalid_argument naming the file where the bag cannot be read
std::vector<CheckRow> checkSession(const std::string& directory, const std::string& ns, bool picture);

}  // namespace vest::session
