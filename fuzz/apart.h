/// A reader whose libraries may end the process that they run in.
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace vest::fuzz {

/// Runs a reader in a process that lives on from input to input, as a process for each would cost more than
/// what it reads. A tool begins one for each (vest_tissue/src/image/worker.h), so a library that crashes
/// there is a refusal here, too. What ends the process elsewhere, and what a sanitizer says of our code, ends
/// this one.
class Apart {
 public:
  /// Of a library's edges, one byte each.
  struct Counters {
    std::uint8_t* at;
    std::size_t count;
  };
  explicit Apart(std::function<void(const std::string&)> run);
  ~Apart();
  Apart(const Apart&) = delete;
  Apart& operator=(const Apart&) = delete;
  void operator()(const std::string& input);

 private:
  struct Shared;
  void begin();
  /// Begins the process again whenever it ends. A fork of the fuzzer itself would have more memory to copy.
  [[noreturn]] void attend(int from, int to);
  [[noreturn]] void serve(int from, int to);
  /// The process is gone: a refusal, or the end of this one.
  void ended();

  std::function<void(const std::string&)> run_;
  Shared* shared_ = nullptr;
  std::vector<Counters> counters_;
  pid_t pid_ = -1, parent_ = -1;
  int to_ = -1, from_ = -1, said_ = -1;
};

}  // namespace vest::fuzz
