#include "vest_instruments/files/cells.h"

#include <algorithm>
#include <utility>

namespace vest::files {

std::vector<std::string> cells(const std::string& line, std::size_t most, char separator) {
  constexpr const char* kBlanks = " \t\r";
  std::vector<std::string> out;
  for (std::size_t from = 0; out.size() <= most;) {
    const std::size_t end = std::min(line.find(separator, from), line.size());
    std::string cell = line.substr(from, end - from);
    cell.erase(cell.find_last_not_of(kBlanks) + 1);
    cell.erase(0, cell.find_first_not_of(kBlanks));
    out.push_back(std::move(cell));
    if (end == line.size()) break;
    from = end + 1;
  }
  return out;
}

}  // namespace vest::files
