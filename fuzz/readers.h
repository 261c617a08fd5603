/// Every reader of files as one function over bytes, for libFuzzer (libfuzzer.cpp) and ./test
/// (test_readers.cpp).
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace vest::scene {
class World;
}

namespace vest::fuzz {

struct Reader {
  const char* name;                                ///< of its folder in fuzz/corpus, too
  std::function<void(const std::string&)> run;     ///< takes or refuses; anything else ends the process
  std::function<std::vector<std::string>()> made;  ///< inputs beside those of the folder; may be empty
};

/// Of all packages.
const std::vector<Reader>& readers();
const Reader& reader(const std::string& name);  ///< ends the process where there is none

/// Kept inputs: files of fuzz/corpus/NAME, and those that the reader makes.
std::vector<std::string> corpus(const Reader& reader);
/// All of them as files: FOLDER/NAME/kept_0 … @param names of readers; empty: all
void keep(const std::string& folder, const std::vector<std::string>& names = {});

/// A folder of this process; input is written there, one file or several: lines "=== NAME" begin the next.
class Folder {
 public:
  Folder();
  ~Folder();
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
  const std::string& path() const { return path_; }
  /// Path of the file with these bytes.
  std::string write(const std::string& name, const std::string& bytes);
  /// A text of several files; what stands before the first mark is `first`. @returns path of `first`
  std::string unpack(const std::string& first, const std::string& text);
  void clear();
  /// Of what was written since, in that order.
  const std::vector<std::string>& names() const { return names_; }

 private:
  std::string path_;
  std::vector<std::string> names_;
};

/// The one that all readers write to.
Folder& folder();

/// That many steps without instruments.
void step(scene::World& world, int count);

/// Runs what reads; true where it took the input. A refusal is one line of printable text that holds `named`
/// (the file). Anything else, as std::bad_alloc, is printed and ends the process.
bool takes(const std::string& named, const std::function<void()>& read);
std::string& lastRefusal();  ///< message of the last that was not taken

/// Inputs of the readers `bag` and `steps` whose session was simulated again for a step or more, so far.
std::uint64_t steppedSessions();

/// libFuzzer's arguments. Where they name no place for what fails, it is build/fuzz/bad/READER: libFuzzer's
/// own would be the folder that the shell is in. The folder is made.
std::vector<std::string> withPlaceOfBad(std::vector<std::string> arguments, const std::string& reader);

/// Files of the repository as inputs beside those of the corpus.
std::function<std::vector<std::string>()> shipped(const std::string& file, const std::string& other = {});

/// The shipped materials, those of these names alone.
std::string materialsOf(const std::vector<std::string>& names);

/// While it lives, three materials are the database that readers look up: all of them take 40 ms to read, for
/// each input.
class FewMaterials {
 public:
  FewMaterials();
  ~FewMaterials();
  FewMaterials(const FewMaterials&) = delete;
  FewMaterials& operator=(const FewMaterials&) = delete;

 private:
  std::string before_;
};

std::vector<Reader> tissueReaders();
std::vector<Reader> stateReaders();
std::vector<Reader> effectsReaders();
std::vector<Reader> hardwareReaders();
std::vector<Reader> sessionReaders();
std::vector<Reader> deviceReaders();
std::vector<Reader> trainingReaders();

}  // namespace vest::fuzz
