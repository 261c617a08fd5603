/// What a program says of a file that it refuses.
#pragma once

#include <string>

#include "vest_instruments/files/read.h"

namespace vest::files {

/// "FILE: cause" in one line that cannot write to a terminal, whatever the file and its folders are called.
/// @param cause what a reader threw: it begins with the file, with another one of its folder, or with neither
inline std::string refusal(const std::string& cause, const std::string& file) {
  const std::string line = shown(cause, 6000), folder = file.substr(0, file.find_last_of('/') + 1);
  const auto begins = [&](const std::string& with) {
    return !with.empty() && line.compare(0, with.size(), with) == 0;
  };
  return begins(shown(file, 6000)) || begins(shown(folder, 6000)) ? line : shown(file, 6000) + ": " + line;
}

}  // namespace vest::files
