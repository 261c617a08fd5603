#include "vest_tissue/scene/scene_files.h"

#include <filesystem>
#include <fstream>
#include <stdexcept>

namespace vest::scene {
namespace {

namespace fs = std::filesystem;

void write(const fs::path& file, const std::string& bytes) {
  std::error_code error;
  fs::create_directories(file.parent_path(), error);
  std::ofstream out(file, std::ios::binary);
  out.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  out.close();
  if (!out) throw std::invalid_argument(file.string() + ": cannot be written");
}

/// Whoever made a recording chose the names: none of them may leave the folder.
bool staysBelow(const std::string& name) {
  if (name.empty() || name.find('\0') != std::string::npos) return false;
  const fs::path path(name);
  if (path.is_absolute()) return false;
  for (const fs::path& part : path)
    if (part == ".." || part == "." || part.empty()) return false;
  return true;
}

}  // namespace

std::string writeSceneFiles(const SceneFiles& files, const std::string& folder) {
  if (files.files.empty()) throw std::invalid_argument("scene: it has no file");
  const fs::path scene = fs::path(folder) / "scene", database = fs::path(folder) / "database";
  for (const auto& [name, bytes] : files.files) {
    if (name == kSuturesFile) {
      write(database / "sutures.yaml", bytes);
      continue;
    }
    if (!staysBelow(name))
      throw std::invalid_argument("scene: its file '" + name +
                                  "' (allowed: a path below the scene's folder)");
    write(scene / name, bytes);
  }
  if (!files.materials.empty()) write(database / "materials.yaml", files.materials);
  return (scene / files.files.front().first).string();
}

}  // namespace vest::scene
