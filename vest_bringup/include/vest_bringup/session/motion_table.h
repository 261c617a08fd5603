#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <vector>

#include <Eigen/Geometry>

namespace vest::session {

/// Recorded motion of tools, a row per moment.
struct MotionTable {
  struct Tool {
    std::string name;
    std::vector<Eigen::Vector3d> position;        ///< m, one per row, any fixed frame
    std::vector<Eigen::Quaterniond> orientation;  ///< unit length, one per row; empty: not recorded
    std::vector<double> jaw;                      ///< rad, one per row; empty: not recorded
  };
  std::string file;
  double start = 0;          ///< s, time of the first row
  std::vector<double> time;  ///< s since the first row, rising
  std::vector<Tool> tools;   ///< in the order of the columns
};

/// Where the values of a table without our header stand.
struct MotionLayout {
  struct Columns {
    std::size_t first = 0, last = 0;  ///< counted from 1: 3 columns x y z, or 7 columns x y z qx qy qz qw
  };
  std::map<std::string, Columns> tools;  ///< empty: the header says it
  std::size_t time_column = 0;           ///< counted from 1; 0: the header's t_s where there is no rate
  double rate = 0.0;                     ///< Hz, where there is no time column; 0: none
  double metres_per_unit = 1.0;          ///< of positions
  double seconds_per_unit = 1.0;         ///< of the time column
};

/// Reads `NAME=2-4,OTHER=9-15`. @throws std::invalid_argument: the text and what is allowed
std::map<std::string, MotionLayout::Columns> parseColumns(const std::string& text);

/// Reads a table of numbers, separated by commas, semicolons or blanks as its first line is, with or without
/// quotes. Empty lines and lines that begin with # are skipped.
///
/// Without a layout the first line names the columns: `t_s`, and for each tool NAME `NAME_x_m, NAME_y_m,
/// NAME_z_m`, and if recorded `NAME_qx, NAME_qy, NAME_qz, NAME_qw` and `NAME_jaw_rad`. Other columns are
/// passed over. With a layout a first line that is no row of numbers is passed over.
///
/// @throws std::invalid_argument one line: file, line, field, value, what is allowed. For files that cannot
/// be read, have fewer than 2 rows, more than 1,500,000 over the number of tools, cells that are no finite
/// numbers, short rows, time that does not rise, coordinates beyond 1e6 m, quaternions of length zero.
MotionTable readMotionTable(const std::string& path, const MotionLayout& layout = {});

}  // namespace vest::session
