// Protects docs/parameters.md: it lists exactly what parameter_edit takes, with the unit and range of the
// code.
#include <cmath>
#include <fstream>
#include <map>
#include <set>
#include <sstream>

#include "play.h"
#include "vest_bringup/exercise/engine.h"
#include "vest_bringup/ros/exercise_file.h"

namespace vest::simulation {
namespace {

struct Row {
  std::string unit, least, greatest;
};

std::string trimmed(const std::string& text) {
  const auto first = text.find_first_not_of(" `");
  return first == std::string::npos ? "" : text.substr(first, text.find_last_not_of(" `") + 1 - first);
}

/// By object (`""` is empty; NET, VESSEL) and parameter.
std::map<std::pair<std::string, std::string>, Row> rowsOfThePage() {
  std::ifstream page(ros::package::getPath("vest_bringup") + "/../docs/parameters.md");
  std::map<std::pair<std::string, std::string>, Row> rows;
  for (std::string line; std::getline(page, line);) {
    if (line.rfind("| ", 0) != 0 || line.find('`') == std::string::npos) continue;
    std::vector<std::string> cells;
    std::stringstream parts(line.substr(1));
    for (std::string cell; std::getline(parts, cell, '|');) cells.push_back(trimmed(cell));
    EXPECT_EQ(cells.size(), 7u) << line;
    const std::string object = cells[0] == "\"\"" ? "" : cells[0], unit = cells[2] == "–" ? "" : cells[2];
    EXPECT_TRUE(rows.insert({{object, cells[1]}, {unit, cells[3], cells[4]}}).second) << "twice: " << line;
    EXPECT_FALSE(cells[6].empty()) << "no meaning: " << line;
  }
  return rows;
}

/// A cell of the page as a number: E is the modulus of the object's law, length that of the vessel.
double value(const std::string& cell, double modulus, double length) {
  if (cell == "length") return length;
  const auto factor = cell.find("·E");
  if (factor != std::string::npos) return std::stod(cell.substr(0, factor)) * modulus;
  return std::stod(cell);
}

TEST(Parameters, ThePageListsExactlyWhatEditsMayChangeWithUnitsAndRanges) {
  const auto rows = rowsOfThePage();
  ASSERT_GT(rows.size(), 20u);
  Play play("arterial_bleeding", true);
  const scene::Description& description = play.world().description();
  exercise::addExercise(exercise::loadExercise(ros_shell::exerciseFile("stop_bleeding")), play.stage);
  std::vector<scene::EditableParameter> edits;
  play.stage.trainer->edits(edits);
  std::set<std::pair<std::string, std::string>> used;
  for (const scene::EditableParameter& p : edits) {
    auto row = rows.find({p.object, p.parameter});
    double modulus = 0, length = 0;
    for (const scene::Object& object : description.objects) {
      if (object.name != p.object) continue;
      modulus = object.law.youngs_modulus;
      length = object.tube.station.back() - object.tube.station.front();
      row = rows.find({"NET", p.parameter});
      if (row == rows.end()) row = rows.find({"VESSEL", p.parameter});
    }
    ASSERT_NE(row, rows.end()) << "not in docs/parameters.md: " << p.object << " " << p.parameter;
    used.insert(row->first);
    EXPECT_EQ(row->second.unit, p.unit) << p.parameter;
    const double least = value(row->second.least, modulus, length),
                 greatest = value(row->second.greatest, modulus, length);
    EXPECT_NEAR(least, p.low, 1e-9 * std::abs(p.low)) << p.parameter;
    EXPECT_NEAR(greatest, p.high, 1e-6 * std::abs(p.high)) << p.parameter;  // stations are float
  }
  for (const auto& [key, row] : rows)
    EXPECT_TRUE(used.count(key)) << "nobody takes " << key.first << " " << key.second;
}

}  // namespace
}  // namespace vest::simulation
