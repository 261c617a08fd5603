#include <charconv>
#include <cmath>
#include <filesystem>
#include <iomanip>
#include <locale>
#include <nlohmann/json.hpp>
#include <sstream>

#include "vest_effects/haemodynamics/network.h"
#include "vest_instruments/files/cells.h"
#include "vest_instruments/files/read.h"
#include "vest_instruments/files/strict_json.h"

namespace vest::haemodynamics {

namespace {

// Far above any real network; bounds the memory of a wrong file, whose cells take 32 bytes and more each.
constexpr std::size_t kMostBytes = 4u << 20;

struct Row {
  int line;
  std::vector<std::string> fields;
};

struct Table {
  std::string file;
  std::map<std::string, std::size_t> column;
  std::vector<Row> rows;
};

std::string readText(const std::string& file) {
  std::string text;
  try {
    text = files::read(file, kMostBytes);
  } catch (const files::Refused& why) {
    throw NetworkError(file, 0, why.field, why.value, why.allowed);
  }
  return text;
}

std::string withoutMark(std::string text) {
  if (text.compare(0, 3, "\xEF\xBB\xBF") == 0) text.erase(0, 3);
  return text;
}

std::string trimmed(const std::string& text) {
  const auto begin = text.find_first_not_of(" \t\r");
  if (begin == std::string::npos) return "";
  return text.substr(begin, text.find_last_not_of(" \t\r") - begin + 1);
}

Table readTable(const std::string& file, const std::string& text, const std::vector<std::string>& columns) {
  Table table;
  table.file = file;
  std::size_t begin = 0;
  int line = 0;
  std::size_t width = 0;
  while (begin < text.size()) {
    auto end = text.find('\n', begin);
    if (end == std::string::npos) end = text.size();
    const std::string content = text.substr(begin, end - begin);
    begin = end + 1;
    ++line;
    if (trimmed(content).empty()) continue;
    auto fields = files::cells(content);
    if (width == 0) {
      width = fields.size();
      for (std::size_t i = 0; i < width; ++i) {
        if (!table.column.emplace(fields[i], i).second)
          throw NetworkError(file, line, "header", fields[i], "each column once");
      }
      for (const auto& name : columns) {
        if (!table.column.count(name)) throw NetworkError(file, line, name, "", "a column of this name");
      }
      continue;
    }
    if (fields.size() != width)
      throw NetworkError(file, line, "row", std::to_string(fields.size()) + " fields",
                         std::to_string(width) + " fields, as in the header");
    table.rows.push_back({line, std::move(fields)});
  }
  if (width == 0) throw NetworkError(file, 0, "header", "", "a line of column names");
  if (table.rows.empty()) throw NetworkError(file, 0, "rows", "0", "at least one row");
  return table;
}

double number(const Table& table, const Row& row, const std::string& field, bool may_be_empty = false) {
  const std::string& text = row.fields[table.column.at(field)];
  if (text.empty() && may_be_empty) return 0;
  double value = 0;
  if (!parseNumber(text, value))
    throw NetworkError(table.file, row.line, field, text, "a finite number with a point");
  return value;
}

long whole(const Table& table, const Row& row, const std::string& field) {
  const std::string& text = row.fields[table.column.at(field)];
  long value = 0;
  const auto result = std::from_chars(text.data(), text.data() + text.size(), value);
  if (text.empty() || result.ec != std::errc() || result.ptr != text.data() + text.size() || value < 0)
    throw NetworkError(table.file, row.line, field, text, "a whole number, 0 or more");
  return value;
}

int lineOfOffset(const std::string& text, std::size_t offset) {
  int line = 1;
  for (std::size_t i = 0; i < offset && i < text.size(); ++i) line += text[i] == '\n';
  return line;
}

// nlohmann's values do not know where they stood: the first "KEY" followed by a colon is their line.
int lineOfKey(const std::string& text, const std::string& key) {
  const std::string quoted = '"' + key + '"';
  for (auto at = text.find(quoted); at != std::string::npos; at = text.find(quoted, at + 1)) {
    const auto next = text.find_first_not_of(" \t\r\n", at + quoted.size());
    if (next != std::string::npos && text[next] == ':') return lineOfOffset(text, at);
  }
  return 0;
}

double caseNumber(const nlohmann::json& object, const std::string& key, Network& network,
                  const std::string& text) {
  const int line = lineOfKey(text, key);
  network.case_lines[key] = line;
  if (!object.contains(key)) throw NetworkError(network.case_file, 0, key, "", "a number: it is required");
  const auto& value = object.at(key);
  if (!value.is_number()) throw NetworkError(network.case_file, line, key, value.dump(), "a finite number");
  return value.get<double>();
}

void readCaseFile(Network& network, const std::string& text) {
  nlohmann::json document;
  try {
    document = files::parseJson(text);
  } catch (const files::Refused& why) {
    throw NetworkError(network.case_file, why.line, why.field, why.value, why.allowed);
  }
  if (!document.is_object()) throw NetworkError(network.case_file, 1, "JSON", "", "an object { … }");
  network.density = caseNumber(document, "rho", network, text);
  network.viscosity = caseNumber(document, "mu", network, text);
  network.profile = caseNumber(document, "zeta", network, text);
  network.period = caseNumber(document, "period_s", network, text);
  const auto given = [&](const char* key) { return document.contains(key) && !document[key].is_null(); };
  if (given("taper") && document["taper"] != "linear")
    throw NetworkError(network.case_file, lineOfKey(text, "taper"), "taper", document["taper"].dump(),
                       "\"linear\"");
  if (given("wall_thickness_law")) {
    const auto& object = document["wall_thickness_law"];
    if (!object.is_object())
      throw NetworkError(network.case_file, lineOfKey(text, "wall_thickness_law"), "wall_thickness_law",
                         object.dump(), "an object with a, b_per_m, c, d_per_m");
    WallThicknessLaw law;
    law.a = caseNumber(object, "a", network, text);
    law.b = caseNumber(object, "b_per_m", network, text);
    law.c = caseNumber(object, "c", network, text);
    law.d = caseNumber(object, "d_per_m", network, text);
    network.wall_thickness_law = law;
    network.case_lines["wall_thickness_law"] = lineOfKey(text, "wall_thickness_law");
  }
}

void readSegments(Network& network, const std::string& text) {
  const Table table = readTable(
      network.network_file, text,
      {"id", "name", "node_in", "node_out", "length_m", "r_prox_m", "r_dist_m", "h_prox_m", "h_dist_m",
       "E_Pa", "P_ref_Pa", "terminal", "R1_Pa_s_m3", "R2_Pa_s_m3", "C_m3_Pa", "P_out_Pa"});
  for (const Row& row : table.rows) {
    SegmentSpec segment;
    segment.line = row.line;
    segment.id = row.fields[table.column.at("id")];
    segment.name = row.fields[table.column.at("name")];
    segment.node_in = whole(table, row, "node_in");
    segment.node_out = whole(table, row, "node_out");
    segment.length = number(table, row, "length_m");
    segment.radius_proximal = number(table, row, "r_prox_m");
    segment.radius_distal = number(table, row, "r_dist_m");
    const bool law = network.wall_thickness_law.has_value();
    segment.wall_proximal = number(table, row, "h_prox_m", law);
    segment.wall_distal = number(table, row, "h_dist_m", law);
    segment.youngs_modulus = number(table, row, "E_Pa");
    segment.reference_pressure = number(table, row, "P_ref_Pa");
    const std::string& terminal = row.fields[table.column.at("terminal")];
    if (terminal != "0" && terminal != "1")
      throw NetworkError(table.file, row.line, "terminal", terminal, "0 or 1");
    segment.terminal = terminal == "1";
    segment.load.proximal_resistance = number(table, row, "R1_Pa_s_m3", !segment.terminal);
    segment.load.distal_resistance = number(table, row, "R2_Pa_s_m3", !segment.terminal);
    segment.load.compliance = number(table, row, "C_m3_Pa", !segment.terminal);
    segment.load.outflow_pressure = number(table, row, "P_out_Pa", !segment.terminal);
    network.segments.push_back(std::move(segment));
  }
}

void readInflow(Network& network, const std::string& text) {
  const Table table = readTable(network.inflow_file, text, {"t_s", "Q_m3_s"});
  for (const Row& row : table.rows)
    network.inflow.push_back({number(table, row, "t_s"), number(table, row, "Q_m3_s"), row.line});
}

std::string message(const std::string& file, int line, const std::string& field, const std::string& value,
                    const std::string& allowed) {
  std::string text = files::shown(file, 4096);
  if (line > 0) text += ":" + std::to_string(line);
  text += ": " + files::shown(field, 200);
  if (!value.empty()) text += " = " + files::shown(value, 100);
  return text + ": allowed is " + allowed;
}

}  // namespace

NetworkError::NetworkError(std::string file, int line, std::string field, std::string value,
                           std::string allowed)
    : std::runtime_error(message(file, line, field, value, allowed)),
      file_(std::move(file)),
      field_(std::move(field)),
      value_(std::move(value)),
      allowed_(std::move(allowed)),
      line_(line) {}

double WallThicknessLaw::thickness(double radius) const {
  return radius * (a * std::exp(b * radius) + c * std::exp(d * radius));
}

bool parseNumber(const std::string& text, double& value) {
  return files::parseNumber(text, value);
}

std::string formatNumber(double value) {
  // With a point in any language, and no digit more than it takes to read it back (GCC 9 has no std::to_chars
  // of doubles).
  std::ostringstream out;
  out.imbue(std::locale::classic());
  double back = 0;
  for (int digits = 15; digits <= 17; ++digits) {
    out.str("");
    out << std::setprecision(digits) << value;
    if (!std::isfinite(value) || (parseNumber(out.str(), back) && back == value)) break;
  }
  return out.str();
}

Network parseCase(const std::string& folder, const CaseTexts& texts) {
  Network network;
  const std::filesystem::path path(folder);
  network.case_file = (path / "case.json").string();
  network.network_file = (path / "network.csv").string();
  network.inflow_file = (path / "inflow.csv").string();
  readCaseFile(network, withoutMark(texts.case_json));
  readSegments(network, withoutMark(texts.network_csv));
  readInflow(network, withoutMark(texts.inflow_csv));
  return network;
}

Network readCase(const std::string& folder) {
  const std::filesystem::path path(folder);
  if (!std::filesystem::is_directory(path))
    throw NetworkError(folder, 0, "CASE_DIR", "", "a folder with case.json, network.csv and inflow.csv");
  return parseCase(folder,
                   {readText((path / "case.json").string()), readText((path / "network.csv").string()),
                    readText((path / "inflow.csv").string())});
}

}  // namespace vest::haemodynamics
