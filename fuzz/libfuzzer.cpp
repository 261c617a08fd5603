// libFuzzer over one reader: VEST_FUZZ_READER=scene vest_fuzz [libFuzzer's options] CORPUS. With
// VEST_FUZZ_READER=list: their names, and their kept inputs into the folder VEST_FUZZ_KEPT, if it is set.
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

#include "readers.h"

namespace {

std::string variable(const char* name) {
  const char* const value = std::getenv(name);
  return value == nullptr ? "" : value;
}

void list() {
  for (const auto& reader : vest::fuzz::readers()) {
    std::printf("%s\n", reader.name);
    const std::string kept = variable("VEST_FUZZ_KEPT");
    if (kept.empty()) continue;
    std::filesystem::create_directories(kept + "/" + reader.name);
    int number = 0;
    for (const auto& input : vest::fuzz::corpus(reader))
      std::ofstream(kept + "/" + reader.name + "/kept_" + std::to_string(number++), std::ios::binary)
          << input;
  }
}

}  // namespace

extern "C" int LLVMFuzzerInitialize(int*, char***) {
  if (variable("VEST_FUZZ_READER") == "list") {
    list();
    std::exit(0);
  }
  return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const vest::fuzz::Reader& reader = vest::fuzz::reader(variable("VEST_FUZZ_READER"));
  reader.run(std::string(reinterpret_cast<const char*>(data), size));
  return 0;
}
