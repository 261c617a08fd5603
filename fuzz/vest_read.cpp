// One reader over files, as hostile_files.py uses it: vest_read NAME FILE… prints what each is refused for;
// vest_read keep FOLDER [READER…] writes the good files of readers, of all if none is named.
#include <cstdio>
#include <cstring>
#include <exception>

#include "readers.h"
#include "vest_instruments/files/read.h"

int main(int argc, char** argv) {
  if (argc < 3) {
    std::fprintf(stderr,
                 "usage: vest_read READER FILE...\n       vest_read keep FOLDER [READER...]\nreaders:");
    for (const auto& reader : vest::fuzz::readers()) std::fprintf(stderr, " %s", reader.name);
    std::fprintf(stderr, "\n");
    return 2;
  }
  if (std::strcmp(argv[1], "keep") == 0) {
    vest::fuzz::keep(argv[2], {argv + 3, argv + argc});
    return 0;
  }
  const auto& reader = vest::fuzz::reader(argv[1]);
  int code = 0;
  for (int i = 2; i < argc; ++i) {
    try {
      const std::string bytes = vest::files::read(argv[i], 64u << 20);
      vest::fuzz::lastRefusal().clear();
      reader.run(bytes);
    } catch (const std::exception& error) {
      vest::fuzz::lastRefusal() = std::string(argv[i]) + ": " + error.what();
    }
    if (vest::fuzz::lastRefusal().empty()) continue;
    std::fprintf(stderr, "vest_read: %s\n", vest::fuzz::lastRefusal().c_str());
    code = 1;
  }
  return code;
}
