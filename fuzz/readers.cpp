#include "readers.h"

#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <stdexcept>

#include "vest_instruments/files/read.h"

namespace vest::fuzz {
namespace {

[[noreturn]] void broken(const std::string& what) {
  std::fprintf(stderr, "vest_fuzz: %s\n", what.c_str());
  std::abort();
}

bool plainName(const std::string& name) {
  return !name.empty() && name.size() <= 40 && name[0] != '.' &&
         name.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789_.") == std::string::npos;
}

}  // namespace

Folder::Folder() {
  // In memory where there is such a place: databases wait for the disk.
  for (const char* const place : {"/dev/shm", "/tmp"}) {
    std::string pattern = std::string(place) + "/vest_fuzz_XXXXXX";
    if (mkdtemp(pattern.data()) == nullptr) continue;
    path_ = pattern;
    return;
  }
  broken("no temporary folder");
}

Folder::~Folder() {
  std::error_code ignored;
  std::filesystem::remove_all(path_, ignored);
}

std::string Folder::write(const std::string& name, const std::string& bytes) {
  const std::string file = path_ + "/" + name;
  std::ofstream(file, std::ios::binary) << bytes;
  names_.push_back(name);
  return file;
}

std::string Folder::unpack(const std::string& first, const std::string& text) {
  clear();
  std::string name = first;
  std::size_t at = 0;
  for (int files = 0; files < 24; ++files) {
    const std::size_t mark = text.compare(at, 4, "=== ") == 0 ? at : text.find("\n=== ", at);
    const std::size_t end = mark == std::string::npos ? text.size() : mark + (mark == at ? 0 : 1);
    if (plainName(name)) write(name, text.substr(at, end - at));
    if (mark == std::string::npos) break;
    const std::size_t line = std::min(text.find('\n', end), text.size());
    name = text.substr(end + 4, line - end - 4);
    at = std::min(line + 1, text.size());
  }
  return path_ + "/" + first;
}

void Folder::clear() {
  for (const auto& name : names_) std::remove((path_ + "/" + name).c_str());
  names_.clear();
}

Folder& folder() {
  static Folder of_all;
  return of_all;
}

std::string materialsOf(const std::vector<std::string>& names) {
  const std::string mark = "\n  - name: ",
                    all = files::read(std::string(VEST_SOURCE_DIR) + "/vest_tissue/data/materials.yaml",
                                      1 << 20);
  std::string made = all.substr(0, all.find(mark));
  for (std::size_t at = all.find(mark), next = 0; at != std::string::npos; at = next) {
    next = all.find(mark, at + 1);
    const std::size_t name = at + mark.size();
    if (std::count(names.begin(), names.end(), all.substr(name, all.find('\n', name) - name)) > 0)
      made += all.substr(at, next - at);
  }
  return made + "\n";
}

namespace {
constexpr const char* kMaterials = "VEST_TISSUE_DATA";
}

FewMaterials::FewMaterials() {
  static const std::string place = [] {
    static Folder few;
    few.write("materials.yaml", materialsOf({"liver", "tube", "bone"}));
    return few.path();
  }();
  if (const char* const before = std::getenv(kMaterials)) before_ = before;
  setenv(kMaterials, place.c_str(), 1);
}

FewMaterials::~FewMaterials() {
  before_.empty() ? unsetenv(kMaterials) : setenv(kMaterials, before_.c_str(), 1);
}

std::string& lastRefusal() {
  static std::string last;
  return last;
}

bool takes(const std::string& named, const std::function<void()>& read) {
  std::string message;
  try {
    read();
    return true;
  } catch (const std::invalid_argument& error) {
    message = error.what();
  } catch (const std::runtime_error& error) {
    message = error.what();
  } catch (const std::exception& error) {
    broken(std::string("no refusal, but ") + error.what());
  }
  if (message.empty() || message.size() > 6000 || files::shown(message, 10000) != message)
    broken("a refusal that is not one printable line: " + files::shown(message, 6000));
  if (message.find(named) == std::string::npos)
    broken("a refusal that does not name " + named + ": " + message);
  lastRefusal() = message;
  return false;
}

const std::vector<Reader>& readers() {
  static const std::vector<Reader> all = [] {
    std::vector<Reader> list;
    for (auto part : {tissueReaders(), stateReaders(), effectsReaders(), hardwareReaders(), sessionReaders(),
                      deviceReaders(), trainingReaders()})
      list.insert(list.end(), part.begin(), part.end());
    return list;
  }();
  return all;
}

const Reader& reader(const std::string& name) {
  for (const Reader& r : readers())
    if (name == r.name) return r;
  std::string known;
  for (const Reader& r : readers()) known += std::string(" ") + r.name;
  broken("no reader '" + name + "'; there are" + known);
}

std::vector<std::string> corpus(const Reader& of) {
  std::vector<std::string> names, inputs;
  const std::string folder = std::string(VEST_SOURCE_DIR) + "/fuzz/corpus/" + of.name;
  std::error_code none;
  for (const auto& entry : std::filesystem::directory_iterator(folder, none)) names.push_back(entry.path());
  std::sort(names.begin(), names.end());
  for (const auto& name : names) inputs.push_back(files::read(name, 1 << 20));
  if (of.made) {
    for (auto& input : of.made()) inputs.push_back(std::move(input));
  }
  return inputs;
}

void keep(const std::string& folder, const std::vector<std::string>& names) {
  for (const Reader& r : readers()) {
    if (!names.empty() && std::find(names.begin(), names.end(), r.name) == names.end()) continue;
    const std::string place = folder + "/" + r.name + "/";
    std::filesystem::create_directories(place);
    int number = 0;
    for (const auto& input : corpus(r))
      std::ofstream(place + "kept_" + std::to_string(number++), std::ios::binary) << input;
  }
}

std::vector<std::string> withPlaceOfBad(std::vector<std::string> arguments, const std::string& reader) {
  const std::string option = "-artifact_prefix=";
  for (const std::string& word : arguments)
    if (word.compare(0, option.size(), option) == 0) return arguments;
  const std::string place = std::string(VEST_SOURCE_DIR) + "/build/fuzz/bad/" + reader + "/";
  std::filesystem::create_directories(place);
  arguments.push_back(option + place);
  return arguments;
}

std::function<std::vector<std::string>()> shipped(const std::string& file, const std::string& other) {
  return [file, other] {
    std::vector<std::string> inputs;
    for (const auto& name : {file, other})
      if (!name.empty()) inputs.push_back(files::read(std::string(VEST_SOURCE_DIR) + "/" + name, 1 << 20));
    return inputs;
  };
}

}  // namespace vest::fuzz
