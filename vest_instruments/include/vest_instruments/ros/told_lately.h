#pragma once

#include <cstddef>
#include <iterator>
#include <map>
#include <string>

namespace vest::ros_shell {

/// Keeps a client's nonsense from filling log and topics: the same sentence comes again after two seconds,
/// and at most 64 different ones come in that time. For one thread.
class ToldLately {
 public:
  /// Whether to be silent. @param sentence its numbers and what follows them do not count @param now s,
  /// steady
  bool operator()(const std::string& sentence, double now) {
    for (auto it = told_.begin(); it != told_.end();)
      it = now - it->second < kAgain ? std::next(it) : told_.erase(it);
    if (told_.size() >= kMost) return true;
    return !told_.emplace(sentence.substr(0, sentence.find_first_of("0123456789")), now).second;
  }

 private:
  static constexpr double kAgain = 2.0;     // s, assumed: a person reads it once
  static constexpr std::size_t kMost = 64;  // assumed
  std::map<std::string, double> told_;      ///< s, when
};

}  // namespace vest::ros_shell
