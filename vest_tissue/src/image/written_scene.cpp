#include "written_scene.h"

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <stdexcept>

#include "vest_instruments/files/read.h"

namespace vest::image {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void unwritten(const std::string& path) {
  throw std::invalid_argument(files::shown(path, 4096) + ": cannot be written");
}

}  // namespace

WrittenScene::WrittenScene(const std::string& directory) : directory_(directory) {
  std::string pattern = (fs::path(directory) / ".vest_XXXXXX").string();
  if (mkdtemp(pattern.data()) == nullptr) unwritten(directory);
  hidden_ = pattern;
}

WrittenScene::~WrittenScene() {
  std::error_code ignored;
  fs::remove_all(hidden_, ignored);
}

void WrittenScene::save(const std::string& name, const std::string& bytes) {
  const fs::path place = fs::path(directory_) / name;
  std::error_code none;
  if (fs::is_directory(place, none))
    throw std::invalid_argument(files::shown(place.string(), 4096) + ": a folder has this name");
  std::ofstream out(fs::path(hidden_) / name, std::ios::binary);
  out << bytes;
  out.close();
  if (!out) unwritten(place.string());
  names_.push_back(name);
}

std::string WrittenScene::finish(const std::string& scene,
                                 const std::function<void(const std::string& scene)>& check) {
  try {
    if (check) check((fs::path(hidden_) / scene).string());
  } catch (const std::exception& error) {
    std::string message = error.what();
    const std::string hidden = files::shown(hidden_, 4096), shown = files::shown(directory_, 4096);
    for (std::size_t at = 0; (at = message.find(hidden, at)) != std::string::npos; at += shown.size())
      message.replace(at, hidden.size(), shown);
    throw std::invalid_argument(message);
  }
  for (const auto& name : names_) {
    std::error_code error;
    fs::rename(fs::path(hidden_) / name, fs::path(directory_) / name, error);
    if (error) unwritten((fs::path(directory_) / name).string());
  }
  return (fs::path(directory_) / scene).string();
}

}  // namespace vest::image
