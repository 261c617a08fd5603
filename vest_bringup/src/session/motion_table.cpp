#include "vest_bringup/session/motion_table.h"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <limits>
#include <set>
#include <sstream>
#include <stdexcept>

#include "vest_instruments/files/cells.h"
#include "vest_instruments/files/read.h"

namespace vest::session {
namespace {

constexpr std::size_t kMostBytes = 128U << 20U, kMostColumns = 1000, kMostLine = 64 * 1024;
/// Rows times tools (assumed): an hour of four tools at 100 Hz.
constexpr std::size_t kMostPositions = 1'500'000;
constexpr double kFarthest = 1e6;  // m
constexpr double kLongest = 1e10;  // s (assumed): clocks count from 1970
constexpr double kMostJaw = 1000;  // rad (assumed): degrees and per cent pass, too

std::string shown(const std::string& text) {
  return text.empty() ? "nothing" : files::shown(text, 40);
}

[[noreturn]] void refuse(const std::string& file, std::size_t line, const std::string& field,
                         const std::string& value, const std::string& allowed) {
  throw std::invalid_argument(file + (line > 0 ? ": line " + std::to_string(line) : "") + ": " +
                              shown(field) + ": " + shown(value) + " (allowed: " + allowed + ")");
}

/// A finite number with a point in every locale; NaN for anything else.
double number(const std::string& text) {
  double value = 0;
  return files::parseNumber(text, value) ? value : std::numeric_limits<double>::quiet_NaN();
}

/// A moment as it was written: a double holds no millionth of a second of clocks that count from 1970.
struct Moment {
  std::int64_t whole = 0;
  double rest = 0;
};

/// @param text a number of the time's unit, checked  @param value of it
Moment moment(const std::string& text, double value) {
  const std::size_t point = std::min(text.find('.'), text.size());
  Moment m;
  char* end = nullptr;
  errno = 0;
  m.whole = std::strtoll(text.c_str(), &end, 10);
  const bool plain = text.find_first_of("eE") == std::string::npos && errno == 0;
  if (!plain || point == 0 || end != text.c_str() + point) return {0, value};
  if (point < text.size()) m.rest = number("0" + text.substr(point));
  if (text[0] == '-') m.rest = -m.rest;
  return std::isfinite(m.rest) ? m : Moment{0, value};
}

/// Cells of a line with the quotes of a spreadsheet: "a, b" is one cell, "" in it a quote.
std::vector<std::string> unquoted(const std::string& line, char separator) {
  std::string plain;
  std::vector<std::string> out;
  bool inside = false;
  for (std::size_t i = 0; i < line.size(); ++i) {
    if (line[i] == '"' && inside && i + 1 < line.size() && line[i + 1] == '"')
      plain += line[++i];
    else if (line[i] == '"')
      inside = !inside;
    else if (line[i] == separator && !inside)
      out.push_back(std::move(plain)), plain.clear();
    else
      plain += line[i];
  }
  out.push_back(std::move(plain));
  // A cell has no line end: the blanks round it go as those of a cell without quotes.
  for (std::string& cell : out) cell = files::cells(cell, 1, '\n').front();
  return out;
}

/// What separates the cells of a table, by its first line. Numbers may have a comma where semicolons stand.
char separatorOf(const std::string& line) {
  if (std::count(line.begin(), line.end(), ';') > 1) return ';';
  return line.find(',') != std::string::npos ? ',' : ' ';
}

std::vector<std::string> split(const std::string& line, char separator) {
  const bool quotes = line.find('"') != std::string::npos;
  if (separator != ' ') return quotes ? unquoted(line, separator) : files::cells(line, kMostLine, separator);
  std::istringstream in(line);
  std::vector<std::string> words;
  for (std::string word; in >> word;) words.push_back(quotes ? unquoted(word, '\n').front() : word);
  return words;
}

/// Where a tool's values stand, counted from 0.
struct Places {
  std::size_t position[3] = {0, 0, 0};
  std::size_t orientation[4] = {0, 0, 0, 0};  // x y z w
  std::size_t jaw = 0;
  bool has_orientation = false, has_jaw = false;
};

struct Plan {
  std::vector<Places> tools;
  std::vector<std::string> names;  ///< of columns, for messages
  std::size_t time = 0, most = 0;
  bool has_time = false;
};

Plan planOf(const std::string& file, std::size_t line, const std::vector<std::string>& header,
            MotionTable& table) {
  Plan plan;
  plan.names = header;
  plan.most = header.empty() ? 0 : header.size() - 1;
  std::map<std::string, std::size_t> at;
  std::set<std::string> twice;
  for (std::size_t i = 0; i < header.size(); ++i)
    if (!at.emplace(header[i], i).second) twice.insert(header[i]);
  const auto find = [&](const std::string& name, std::size_t& place) {
    const auto found = at.find(name);
    if (twice.count(name)) refuse(file, line, "header", name + " twice", "each column once");
    if (found != at.end()) place = found->second;
    return found != at.end();
  };
  plan.has_time = find("t_s", plan.time);
  for (const std::string& column : header) {
    const std::string end = "_x_m";
    if (column.size() <= end.size() || column.compare(column.size() - end.size(), end.size(), end) != 0)
      continue;
    const std::string name = column.substr(0, column.size() - end.size());
    if (files::shown(name) != name)
      refuse(file, line, "header", name, "names of tools of at most 60 printable characters");
    Places places;
    const char* const axes[3] = {"_x_m", "_y_m", "_z_m"};
    for (int k = 0; k < 3; ++k)
      if (!find(name + axes[k], places.position[k]))
        refuse(file, line, "header", "no " + name + axes[k],
               name + "_x_m, " + name + "_y_m and " + name + "_z_m");
    const char* const parts[4] = {"_qx", "_qy", "_qz", "_qw"};
    int there = 0;
    for (int k = 0; k < 4; ++k) there += find(name + parts[k], places.orientation[k]);
    if (there != 0 && there != 4)
      refuse(file, line, "header", name + " with " + std::to_string(there) + " of its quaternion's columns",
             "all of " + name + "_qx _qy _qz _qw, or none");
    places.has_orientation = there == 4;
    places.has_jaw = find(name + "_jaw_rad", places.jaw);
    plan.tools.push_back(places);
    table.tools.push_back({name, {}, {}, {}});
  }
  if (plan.tools.empty())
    refuse(file, line, "header", "no tool",
           "t_s, NAME_x_m, NAME_y_m, NAME_z_m …; --columns for other tables");
  return plan;
}

Plan planOf(const MotionLayout& layout, MotionTable& table) {
  Plan plan;
  plan.has_time = layout.time_column > 0;
  plan.time = plan.has_time ? layout.time_column - 1 : 0;
  plan.most = plan.time;
  for (const auto& [name, columns] : layout.tools) {
    Places places;
    for (std::size_t k = 0; k < 3; ++k) places.position[k] = columns.first - 1 + k;
    places.has_orientation = columns.last - columns.first == 6;
    for (std::size_t k = 0; k < 4; ++k) places.orientation[k] = columns.first + 2 + k;
    plan.most = std::max(plan.most, columns.last - 1);
    plan.tools.push_back(places);
    table.tools.push_back({name, {}, {}, {}});
  }
  return plan;
}

class Reader {
 public:
  Reader(std::string path, const MotionLayout& layout) : path_(std::move(path)), layout_(layout) {
    table_.file = path_;
  }

  MotionTable read() {
    std::string text;
    try {
      text = files::read(path_, kMostBytes);
    } catch (const files::Refused& e) {
      refuse(path_, 0, e.field, e.value, "a file of at most 128 MB with a table of numbers");
    }
    if (text.compare(0, 2, "\xFF\xFE") == 0 || text.compare(0, 2, "\xFE\xFF") == 0)
      refuse(path_, 0, "file", "text in UTF-16", "text in UTF-8, as a spreadsheet saves CSV");
    if (text.find('\n') == std::string::npos) std::replace(text.begin(), text.end(), '\r', '\n');
    for (std::size_t at = text.compare(0, 3, "\xEF\xBB\xBF") == 0 ? 3 : 0; at < text.size();) {
      ++number_;
      const std::size_t end = std::min(text.find('\n', at), text.size());
      if (end - at >= kMostLine) refuse(path_, number_, "row", "longer than 64 KiB", "a row of numbers");
      const std::string line = text.substr(at, end - at);
      at = end + 1;
      if (line.find_first_not_of(" \t\r") == std::string::npos || line[0] == '#') continue;
      // A title above a foreign table has none.
      if (!planned_ || cells_ == 0) separator_ = separatorOf(line);
      take(split(line, separator_));
    }
    if (table_.time.size() < 2)
      refuse(path_, 0, "file", std::to_string(table_.time.size()) + " rows", "2 or more rows of numbers");
    return std::move(table_);
  }

 private:
  void take(const std::vector<std::string>& cells) {
    if (cells.size() > kMostColumns)
      refuse(path_, number_, "row", std::to_string(cells.size()) + " cells", "at most 1000");
    if (!planned_) {
      planned_ = true;
      const bool foreign = !layout_.tools.empty();
      plan_ = foreign ? planOf(layout_, table_) : planOf(path_, number_, cells, table_);
      cells_ = cells.size();
      const auto stamps = std::find(cells.begin(), cells.end(), "t_s");
      const bool stamped = !plan_.has_time && layout_.rate <= 0.0 && stamps != cells.end();
      if (stamped) {
        plan_.has_time = true, plan_.time = static_cast<std::size_t>(stamps - cells.begin());
        plan_.most = std::max(plan_.most, plan_.time);
      }
      if (!plan_.has_time && layout_.rate <= 0.0)
        refuse(path_, number_, "time", "none", "a column t_s, --time COLUMN, or --rate HZ");
      // A foreign table may begin with a header of its own.
      if (foreign && !stamped) cells_ = 0;  // it may be a title: the first row of numbers says how many
      if (!foreign || std::isnan(number(cells[0]))) return;
    }
    if (cells_ == 0) cells_ = cells.size();
    row(cells);
  }

  double value(const std::vector<std::string>& cells, std::size_t place) const {
    const double v = number(cells[place]);
    if (std::isnan(v))
      refuse(
          path_, number_, columnName(place), cells[place],
          cells[place].find(',') == std::string::npos ? "a finite number" : "a number with a decimal point");
    return v;
  }

  std::string columnName(std::size_t place) const {
    return place < plan_.names.size() ? plan_.names[place] : "column " + std::to_string(place + 1);
  }

  void row(const std::vector<std::string>& cells) {
    if (cells.size() != cells_ || cells.size() <= plan_.most)
      refuse(path_, number_, "row", std::to_string(cells.size()) + " cells",
             std::to_string(std::max(cells_, plan_.most + 1)) + " cells");
    const std::size_t most = kMostPositions / table_.tools.size();
    if (table_.time.size() == most)
      refuse(
          path_, number_, "file", "more rows",
          "at most " + std::to_string(most) + " rows of " + std::to_string(table_.tools.size()) + " tools");
    table_.time.push_back(plan_.has_time ? since(cells)
                                         : static_cast<double>(table_.time.size()) / layout_.rate);
    for (std::size_t i = 0; i < plan_.tools.size(); ++i) {
      const Places& places = plan_.tools[i];
      MotionTable::Tool& tool = table_.tools[i];
      Eigen::Vector3d p;
      for (int k = 0; k < 3; ++k) {
        p[k] = layout_.metres_per_unit * value(cells, places.position[k]);
        if (std::abs(p[k]) > kFarthest)
          refuse(path_, number_, columnName(places.position[k]), cells[places.position[k]],
                 "-1e6 to 1e6 m; --unit for other units");
      }
      tool.position.push_back(p);
      if (places.has_orientation) {
        Eigen::Quaterniond q;
        for (int k = 0; k < 4; ++k) q.coeffs()[k] = value(cells, places.orientation[k]);
        const double length = q.norm();
        if (!(length > 1e-3 && length < 1e3))
          refuse(path_, number_, columnName(places.orientation[0]),
                 "a quaternion of length " + std::to_string(length), "length 1");
        q.coeffs() /= length;
        tool.orientation.push_back(q);
      }
      if (!places.has_jaw) continue;
      tool.jaw.push_back(value(cells, places.jaw));
      if (std::abs(tool.jaw.back()) > kMostJaw)
        refuse(path_, number_, columnName(places.jaw), cells[places.jaw], "-1000 to 1000 rad");
    }
  }

  /// s from the first row to this one.
  double since(const std::vector<std::string>& cells) {
    const std::string& text = cells[plan_.time];
    const double unit = layout_.seconds_per_unit, at = value(cells, plan_.time);
    if (std::abs(at * unit) > kLongest)
      refuse(path_, number_, columnName(plan_.time), text, "-1e10 to 1e10 s");
    const Moment now = moment(text, at);
    if (table_.time.empty()) first_ = now, table_.start = unit * at;
    const double t = unit * (static_cast<double>(now.whole - first_.whole) + (now.rest - first_.rest));
    if (!table_.time.empty() && !(t > table_.time.back()))
      refuse(path_, number_, columnName(plan_.time), text, "later than the row before, " + before_);
    before_ = text;
    return t;
  }

  std::string path_;
  const MotionLayout& layout_;
  MotionTable table_;
  Plan plan_;
  char separator_ = ',';
  Moment first_;
  std::string before_;  ///< the last row's time as it was written
  bool planned_ = false;
  std::size_t number_ = 0, cells_ = 0;
};

}  // namespace

std::map<std::string, MotionLayout::Columns> parseColumns(const std::string& text) {
  const auto wrong = [&](const std::string& part) {
    throw std::invalid_argument(
        "--columns " + shown(text) + ": " + shown(part) +
        " (allowed: NAME=2-4 for x y z or NAME=2-8 for x y z qx qy qz qw, counted from 1, "
        "several separated by commas)");
  };
  std::map<std::string, MotionLayout::Columns> out;
  for (std::size_t begin = 0; begin <= text.size();) {
    const std::size_t end = std::min(text.find(',', begin), text.size());
    const std::string part = text.substr(begin, end - begin);
    begin = end + 1;
    const std::size_t equals = part.find('='),
                      dash = part.find('-', equals == std::string::npos ? 0 : equals);
    if (equals == std::string::npos || equals == 0 || dash == std::string::npos) wrong(part);
    const std::string first = part.substr(equals + 1, dash - equals - 1), last = part.substr(dash + 1);
    for (const std::string& digits : {first, last})
      if (digits.empty() || digits.size() > 4 || digits.find_first_not_of("0123456789") != std::string::npos)
        wrong(part);
    const MotionLayout::Columns columns{std::stoul(first), std::stoul(last)};
    const std::size_t count = columns.last - columns.first + 1;
    if (columns.first == 0 || columns.last > kMostColumns || columns.last < columns.first ||
        (count != 3 && count != 7))
      wrong(part);
    if (!out.emplace(part.substr(0, equals), columns).second) wrong(part + " twice");
  }
  return out;
}

MotionTable readMotionTable(const std::string& path, const MotionLayout& layout) {
  return Reader(path, layout).read();
}

}  // namespace vest::session
