// libFuzzer over one reader: VEST_FUZZ_READER=scene vest_fuzz [libFuzzer's options] CORPUS. With
// VEST_FUZZ_READER=list: their names, and their kept inputs into the folder VEST_FUZZ_KEPT, if it is set.
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include "readers.h"

namespace {

std::string variable(const char* name) {
  const char* const value = std::getenv(name);
  return value == nullptr ? "" : value;
}

void list() {
  for (const auto& reader : vest::fuzz::readers()) std::printf("%s\n", reader.name);
  if (!variable("VEST_FUZZ_KEPT").empty()) vest::fuzz::keep(variable("VEST_FUZZ_KEPT"));
}

}  // namespace

extern "C" int LLVMFuzzerInitialize(int* argc, char*** argv) {
  if (variable("VEST_FUZZ_READER") == "list") {
    list();
    std::exit(0);
  }
  // What it is read into takes up to minutes to make, which is no input's time.
  const vest::fuzz::Reader& reader = vest::fuzz::reader(variable("VEST_FUZZ_READER"));
  if (reader.made) reader.made();
  // A reader's own process (apart.h) begins before the fuzzer has a second thread, whose locks it would keep.
  reader.run({});
  static std::vector<std::string> words = vest::fuzz::withPlaceOfBad({*argv, *argv + *argc}, reader.name);
  static std::vector<char*> pointers;
  for (std::string& word : words) pointers.push_back(word.data());
  *argc = static_cast<int>(pointers.size());
  pointers.push_back(nullptr);
  *argv = pointers.data();
  std::atexit([] {
    if (const auto stepped = vest::fuzz::steppedSessions())
      std::fprintf(stderr, "sessions that reached a step: %llu\n", static_cast<unsigned long long>(stepped));
  });
  return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const vest::fuzz::Reader& reader = vest::fuzz::reader(variable("VEST_FUZZ_READER"));
  reader.run(std::string(reinterpret_cast<const char*>(data), size));
  return 0;
}
