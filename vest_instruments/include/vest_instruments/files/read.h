/// Files of strangers: bounded, never waited for, shown in messages without what they would do to a terminal.
#pragma once

#include <cstddef>
#include <stdexcept>
#include <string>

namespace vest::files {

/// Why a file is refused; readers put file and their own type of error around it.
struct Refused : std::invalid_argument {
  Refused(int line, std::string field, std::string value, std::string allowed);
  int line;  ///< from 1; 0: the whole file
  std::string field, value, allowed;
};

/// All bytes of a regular file. Pipes, devices, sockets and folders are refused at once: nobody waits for
/// them. @throws Refused: field "file"; also above `most` bytes, before they are read
std::string read(const std::string& path, std::size_t most);

/// A text for messages, one line of at most `most` characters: control characters, marks of writing direction
/// and bytes that are no UTF-8 are written as \xNN.
std::string shown(const std::string& text, std::size_t most = 60);

/// A finite decimal number and nothing else, with a point in every locale.
bool parseNumber(const std::string& text, double& value);

}  // namespace vest::files
