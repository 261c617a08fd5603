#include "csv_reader.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <sstream>

#include "vest_instruments/files/cells.h"
#include "vest_instruments/files/read.h"
#include "vest_tissue/files/yaml_reader.h"

namespace vest::scene::csv {
namespace {

constexpr std::size_t kMostCells = 64;        // of a line (assumed)
constexpr std::size_t kMostValues = 8000000;  // of a table (assumed): two seconds, 300 MB

}  // namespace

int Table::column(const std::string& name) const {
  const auto found = std::find(columns.begin(), columns.end(), name);
  return found == columns.end() ? -1 : static_cast<int>(found - columns.begin());
}

std::size_t Table::index(std::size_t row, const std::string& name, std::size_t most) const {
  const double value = rows[row][static_cast<std::size_t>(column(name))];
  if (!(value >= 0 && value <= static_cast<double>(most)) || value != std::floor(value)) {
    std::ostringstream text;
    text << value;
    yaml::fail(file, lines[row], name, text.str(),
               "must be a whole number from 0 to " + std::to_string(most));
  }
  return static_cast<std::size_t>(value);
}

double Table::within(std::size_t row, const std::string& name, double most, const char* what) const {
  const double value = rows[row][static_cast<std::size_t>(column(name))];
  if (std::abs(value) <= most) return value;
  char number[32], end[32];
  std::snprintf(number, sizeof number, "%g", value);
  std::snprintf(end, sizeof end, "%.0f", most);
  yaml::fail(file, lines[row], name, number, std::string("must be ") + what + " from -" + end + " to " + end);
}

Eigen::Vector3d Table::vector(std::size_t row, const char* const (&names)[3], double most,
                              const char* what) const {
  return {within(row, names[0], most, what), within(row, names[1], most, what),
          within(row, names[2], most, what)};
}

Table read(const std::string& path, const std::string& bytes, const std::vector<std::string>& required,
           const std::vector<std::string>& optional) {
  Table table;
  table.file = path;
  std::istringstream stream(bytes);
  std::string line;
  int number = 0;
  while (std::getline(stream, line)) {
    ++number;
    if (line.find_first_not_of(" \t\r") == std::string::npos || line[0] == '#') continue;
    const auto cells = files::cells(line, kMostCells);
    if (table.columns.empty()) {
      table.columns = cells;
      std::string allowed = "columns are";
      for (const auto& name : required) allowed += " " + name;
      for (const auto& name : optional) allowed += " [" + name + "]";
      for (std::size_t i = 0; i < cells.size(); ++i) {
        const bool known = std::find(required.begin(), required.end(), cells[i]) != required.end() ||
                           std::find(optional.begin(), optional.end(), cells[i]) != optional.end();
        if (!known) yaml::fail(path, number, "header", cells[i], allowed);
        if (std::find(cells.begin(), cells.begin() + static_cast<std::ptrdiff_t>(i), cells[i]) !=
            cells.begin() + static_cast<std::ptrdiff_t>(i)) {
          yaml::fail(path, number, "header", cells[i] + " twice", allowed);
        }
      }
      for (const auto& name : required) {
        if (table.column(name) < 0) yaml::fail(path, number, "header", "no " + name, allowed);
      }
      continue;
    }
    if (cells.size() != table.columns.size()) {
      yaml::fail(path, number, "row", std::to_string(cells.size()) + " cells",
                 "must have " + std::to_string(table.columns.size()) + " cells");
    }
    const std::size_t most = kMostValues / table.columns.size();
    if (table.rows.size() == most)
      yaml::fail(path, number, "row", std::to_string(most + 1),
                 "must be at most " + std::to_string(most) + " rows of " +
                     std::to_string(table.columns.size()) + " columns");
    std::vector<double> row;
    row.reserve(cells.size());
    for (std::size_t i = 0; i < cells.size(); ++i) {
      double value = 0;
      if (!files::parseNumber(cells[i], value)) {
        yaml::fail(path, number, table.columns[i], cells[i].empty() ? "nothing" : cells[i],
                   "must be a finite number");
      }
      row.push_back(value);
    }
    table.rows.push_back(std::move(row));
    table.lines.push_back(number);
  }
  if (table.columns.empty()) yaml::fail(path, 0, "file", "empty", "must begin with a header line");
  return table;
}

}  // namespace vest::scene::csv
