#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

namespace vest::scene::csv {

/// A table of numbers with a header line: `node,x,y,z`. Strict: known columns only, finite numbers, no empty
/// cells.
struct Table {
  std::string file;
  std::vector<std::string> columns;
  std::vector<std::vector<double>> rows;
  std::vector<int> lines;  ///< line in the file per row

  /// Column index, or -1.
  int column(const std::string& name) const;
  /// Whole number of 0 … most. @throws std::invalid_argument: file, line, column, value, what is allowed
  std::size_t index(std::size_t row, const std::string& name, std::size_t most) const;
  /// A number from -most to most. @param what it is, for the message: "a coordinate"
  /// @throws std::invalid_argument: file, line, column, value, what is allowed
  double within(std::size_t row, const std::string& name, double most, const char* what) const;
  /// Three of them.
  Eigen::Vector3d vector(std::size_t row, const char* const (&names)[3], double most, const char* what) const;
};

/// @param required columns that must be there, @param optional columns that may be there
/// @throws std::invalid_argument
Table read(const std::string& path, const std::string& bytes, const std::vector<std::string>& required,
           const std::vector<std::string>& optional);

}  // namespace vest::scene::csv
