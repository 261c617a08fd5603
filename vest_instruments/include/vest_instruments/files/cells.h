#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace vest::files {

/// Cells of a line of a table, without the blanks around each. Those within stay: "1 2" is no number.
/// @param most cells that a line may have; where it has more, one more is returned, which is enough to say so
std::vector<std::string> cells(const std::string& line, std::size_t most = 1000000, char separator = ',');

}  // namespace vest::files
