#include "vest_tissue/volume/transfer_table.h"

#include <algorithm>
#include <sstream>

#include "../files/csv_reader.h"
#include "vest_tissue/files/yaml_reader.h"

namespace vest::volume {
namespace {

constexpr std::size_t kMostBytes = 1u << 20, kMostRows = 256;
constexpr double kMostValue = 1e9;  // as far as 16 bits, scaled, go in any image that is taken (assumed)
const char* const kFeel[] = {"stiffness", "yield", "viscosity", "friction"};

}  // namespace

TransferTable readTransferTable(const std::string& path) {
  return readTransferTable(path, scene::yaml::readFile(path, kMostBytes));
}

TransferTable readTransferTable(const std::string& path, const std::string& bytes) {
  const auto read = scene::csv::read(path, bytes, {"value", "red", "green", "blue", "alpha"},
                                     {kFeel, kFeel + std::size(kFeel)});
  TransferTable table;
  const auto cell = [&](std::size_t row, const char* name, double least, double most) {
    const int column = read.column(name);
    if (column < 0) return 0.0;
    const double value = read.rows[row][static_cast<std::size_t>(column)];
    if (value >= least && value <= most) return value;
    std::ostringstream text, allowed;
    text << value;
    allowed << "must be from " << least << " to " << most;
    scene::yaml::fail(path, read.lines[row], name, text.str(), allowed.str());
  };
  for (std::size_t r = 0; r < read.rows.size(); ++r) {
    Transfer row;
    row.value = cell(r, "value", -kMostValue, kMostValue);
    row.colour = {cell(r, "red", 0, 1), cell(r, "green", 0, 1), cell(r, "blue", 0, 1)};
    row.alpha = cell(r, "alpha", 0, 1);
    for (std::size_t f = 0; f < std::size(kFeel); ++f) row.feel[f] = cell(r, kFeel[f], 0, 1e6);
    if (!table.empty() && !(row.value > table.back().value)) {
      std::ostringstream text;
      text << row.value;
      scene::yaml::fail(path, read.lines[r], "value", text.str(), "must be above that of the row before");
    }
    table.push_back(row);
  }
  if (table.size() < 2 || table.size() > kMostRows)
    scene::yaml::fail(path, 0, "rows", std::to_string(table.size()),
                      "must be 2 to " + std::to_string(kMostRows));
  return table;
}

Transfer transfer(const TransferTable& table, double value) {
  if (!(value > table.front().value)) return table.front();
  if (value >= table.back().value) return table.back();
  const auto above = std::upper_bound(table.begin(), table.end(), value,
                                      [](double v, const Transfer& row) { return v < row.value; });
  const Transfer &a = above[-1], &b = *above;
  const double t = (value - a.value) / (b.value - a.value);
  const auto mix = [t](double x, double y) { return x + t * (y - x); };
  Transfer between;
  between.value = value;
  between.alpha = mix(a.alpha, b.alpha);
  for (std::size_t c = 0; c < a.colour.size(); ++c) between.colour[c] = mix(a.colour[c], b.colour[c]);
  for (std::size_t f = 0; f < a.feel.size(); ++f) between.feel[f] = mix(a.feel[f], b.feel[f]);
  return between;
}

}  // namespace vest::volume
