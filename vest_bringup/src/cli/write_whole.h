#pragma once

#include <cstdio>
#include <fstream>
#include <stdexcept>
#include <string>

#include "vest_instruments/files/replace.h"

namespace vest::tools {

/// Writes a file beside itself and renames it: a full disk leaves the one that was there.
/// @throws std::runtime_error: one message
inline void writeWhole(const std::string& file, const std::string& text) {
  const std::string beside = file + ".new";
  std::ofstream out = files::replacing(beside);
  out << text;
  out.close();
  if (out && std::rename(beside.c_str(), file.c_str()) == 0) return;
  std::remove(beside.c_str());
  throw std::runtime_error(file + ": cannot be written (is the disk full?)");
}

}  // namespace vest::tools
