#pragma once

#include <unistd.h>

#include <fstream>
#include <string>

namespace vest::files {

/// A new file in the place of the one that stands there. Where that is a link, what it leads to stays as it
/// is: a folder of a stranger may have links where a tool writes. For names that a tool chooses, not for
/// those that a user gives: /dev/stdout is none to be replaced.
inline std::ofstream replacing(const std::string& path) {
  ::unlink(path.c_str());
  return std::ofstream(path, std::ios::binary);
}

}  // namespace vest::files
