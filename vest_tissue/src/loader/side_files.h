#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include <xxhash.h>

#include "vest_instruments/files/read.h"
#include "vest_tissue/files/yaml_reader.h"
#include "vest_tissue/material/database.h"
#include "vest_tissue/material/sutures.h"
#include "vest_tissue/scene/baked.h"
#include "vest_tissue/scene/scene_files.h"

namespace vest::scene {

using yaml::Value;

constexpr std::size_t kMaxSideFile = kMostBaked;
constexpr std::size_t kMaxAllFiles = 128u << 20;

/// Reads files below the scene's folder; their bytes belong to the hash.
class Files {
 public:
  /// @param kept gets what is read; may be null
  Files(const std::string& scene, std::string directory, const std::string& scene_bytes, SceneFiles* kept)
      : scene_(scene), directory_(std::move(directory)), state_(XXH64_createState()), kept_(kept) {
    XXH64_reset(state_.get(), 0);
    hash(scene_bytes);
  }

  std::string read(const Value& value, std::string& path) { return read(value, path, value.string()); }
  /// A file that the value means by another name.
  std::string read(const Value& value, std::string& path, const std::string& name) {
    path = yaml::resolve(directory_, name, value.file(), value.line(), value.field());
    std::string bytes, is;
    try {
      bytes = files::read(path, kMaxSideFile);
    } catch (const files::Refused& why) {
      is = why.value;
    }
    if (is.empty() && !below(path)) is = "a link to elsewhere";
    if (!is.empty()) {
      value.fail("must name a readable file below " + directory_ + " of at most " +
                 std::to_string(kMaxSideFile) + " bytes; it is: " + is);
    }
    all_ += bytes.size();
    if (all_ > kMaxAllFiles)
      value.fail("with it the scene has " + std::to_string(all_) + " bytes in files; allowed are " +
                 std::to_string(kMaxAllFiles));
    hash(bytes);
    if (kept_) kept_->files.emplace_back(path.substr(directory_.size() + 1), bytes);
    return bytes;
  }
  /// A material of the database, whose bytes belong to the hash from then on; null where it has none of the
  /// name.
  const material::Tissue* known(const std::string& name) {
    if (database_.tissues.empty()) {
      const std::string path = material::databasePath();
      database_ = material::readDatabase(path);
      const std::string bytes = yaml::readFile(path, yaml::kMaxBytes);
      hash(bytes);
      if (kept_) kept_->materials = bytes;
    }
    for (const material::Tissue& tissue : database_.tissues)
      if (tissue.name == name) return &tissue;
    return nullptr;
  }
  const material::Tissue& material(const Value& name) {
    if (const material::Tissue* tissue = known(name.name())) return *tissue;
    std::string known;
    for (const material::Tissue& tissue : database_.tissues)
      known += (known.empty() ? "" : ", ") + tissue.name;
    name.fail("must be a material of the database: " + known);
  }
  /// The sutures that VEST ships, whose bytes belong to the hash from then on.
  const material::Sutures& sutures() {
    if (sutures_.sizes.empty()) {
      sutures_ = material::readSutures(material::suturesPath());
      const std::string bytes = yaml::readFile(sutures_.file, yaml::kMaxBytes);
      hash(bytes);
      if (kept_) kept_->files.emplace_back(kSuturesFile, bytes);
    }
    return sutures_;
  }
  std::string hash() const { return digits(XXH64_digest(state_.get())); }

 private:
  struct Free {
    void operator()(XXH64_state_t* state) const { XXH64_freeState(state); }
  };
  void hash(const std::string& bytes) { XXH64_update(state_.get(), bytes.data(), bytes.size()); }
  /// Links may lead about within the folder, or within that of the file which the scene's own name leads to.
  bool below(const std::string& path) const {
    namespace fs = std::filesystem;
    std::error_code error;
    const fs::path file = fs::canonical(path, error);
    for (const fs::path& folder :
         {fs::canonical(directory_, error), fs::canonical(scene_, error).parent_path()}) {
      const auto rest = file.lexically_relative(folder);
      if (!error && !rest.empty() && *rest.begin() != "..") return true;
    }
    return false;
  }

  std::string scene_, directory_;
  std::unique_ptr<XXH64_state_t, Free> state_;
  std::size_t all_ = 0;
  SceneFiles* kept_;
  material::Database database_;
  material::Sutures sutures_;
};

}  // namespace vest::scene
