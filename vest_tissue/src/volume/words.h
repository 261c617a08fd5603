#pragma once

#include <cctype>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

#include "vest_instruments/files/read.h"

namespace vest::volume {

inline constexpr std::size_t kMostNodes = 2000000;  ///< of a file (assumed)
inline constexpr double kFarthest = 1e6;            ///< of a coordinate: a kilometre in millimetres (assumed)

/// Words of a text file, with the line for messages.
class Words {
 public:
  Words(const std::string& path, const std::string& bytes) : path_(path), bytes_(bytes) {}

  [[noreturn]] void fail(const std::string& what) const {
    throw std::invalid_argument(files::shown(path_, 4096) + ":" + std::to_string(line_) + ": " +
                                files::shown(what, 300));
  }
  bool next(std::string& word) {
    while (at_ < bytes_.size() && std::isspace(static_cast<unsigned char>(bytes_[at_]))) {
      if (bytes_[at_++] == '\n') ++line_;
    }
    const std::size_t first = at_;
    while (at_ < bytes_.size() && !std::isspace(static_cast<unsigned char>(bytes_[at_]))) ++at_;
    word.assign(bytes_, first, at_ - first);
    return !word.empty();
  }
  std::string word(const char* what) {
    std::string w;
    if (!next(w)) fail(std::string("ends where ") + what + " was expected");
    return w;
  }
  /// Next word of this line; false at its end.
  bool nextOfLine(std::string& word) {
    while (at_ < bytes_.size() && bytes_[at_] != '\n' &&
           std::isspace(static_cast<unsigned char>(bytes_[at_])))
      ++at_;
    if (at_ >= bytes_.size() || bytes_[at_] == '\n') return false;
    return next(word);
  }
  void skipLine() {
    while (at_ < bytes_.size() && bytes_[at_] != '\n') ++at_;
  }
  double toNumber(const std::string& word, const char* what) const {
    double value = 0.0;
    if (!files::parseNumber(word, value))
      fail(std::string(what) + ": '" + files::shown(word, 40) + "'; allowed: a finite number");
    return value;
  }
  double number(const char* what) { return toNumber(word(what), what); }
  double coordinate() {
    const std::string w = word("a coordinate");
    const double value = toNumber(w, "a coordinate");
    if (!(std::fabs(value) <= kFarthest))
      fail("a coordinate: " + files::shown(w, 40) + "; allowed: from -1e6 to 1e6");
    return value;
  }
  std::size_t whole(const char* what, std::size_t most, std::size_t least = 0) {
    const std::string w = word(what);
    const double value = toNumber(w, what);
    if (!(value >= static_cast<double>(least) && value <= static_cast<double>(most)) ||
        value != std::floor(value))
      fail(std::string(what) + ": " + files::shown(w, 40) + "; allowed: whole numbers from " +
           std::to_string(least) + " to " + std::to_string(most));
    return static_cast<std::size_t>(value);
  }
  /// A count of things of which each takes at least two bytes of the file.
  std::size_t count(const char* what) { return whole(what, std::min(kMostNodes * 8, bytes_.size() / 2 + 1)); }
  void expect(const char* wanted) {
    const std::string w = word(wanted);
    if (w != wanted) fail("'" + files::shown(w, 40) + "'; allowed here: " + wanted);
  }
  int line() const { return line_; }
  std::size_t place() const { return at_; }  ///< bytes behind what was read

 private:
  const std::string& path_;
  const std::string& bytes_;
  std::size_t at_ = 0;
  int line_ = 1;
};

}  // namespace vest::volume
