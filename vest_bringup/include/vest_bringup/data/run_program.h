#pragma once

#include <string>
#include <vector>

namespace vest::data {

/// Runs a program, looked up on PATH, and waits for it.
/// @param words the program and its arguments  @param log file that gets its standard output
/// @param errors_too its standard error goes there as well, not to ours
/// @return its exit status; 127: it cannot be run, −1: it was killed
int runProgram(std::vector<std::string> words, const std::string& log, bool errors_too);

}  // namespace vest::data
