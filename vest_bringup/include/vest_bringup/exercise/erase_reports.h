#pragma once

#include <filesystem>
#include <string>

#include <nlohmann/json.hpp>

#include "vest_instruments/files/read.h"
#include "vest_instruments/files/strict_json.h"

namespace vest::exercise {

/// Removes what vest_score wrote into a session's folder that names a trainee: report.html, report.pdf,
/// xapi.json, learning.json, learning.csv. A folder whose statement is another's, or has none, stays as it
/// is: names of folders come from the database, which may be a stranger's. Recording, score.json,
/// motion.json and trace.csv name nobody.
/// @return whether there was such a report  @throws std::filesystem::filesystem_error where one stays
inline bool eraseReports(const std::string& directory, const std::string& trainee) {
  const std::filesystem::path folder(directory);
  try {
    const auto statement = files::parseJson(files::read((folder / "xapi.json").string(), 1U << 20U));
    if (directory.empty() || statement.at("actor").at("account").at("name") != trainee) return false;
  } catch (const files::Refused&) {
    return false;
  } catch (const nlohmann::json::exception&) {
    return false;
  }
  // The statement goes last: where one cannot be removed, the next call tries again.
  for (const char* name : {"report.html", "report.pdf", "learning.json", "learning.csv", "xapi.json"})
    std::filesystem::remove(folder / name);
  return true;
}

}  // namespace vest::exercise
