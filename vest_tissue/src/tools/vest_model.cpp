#include <cstdio>
#include <exception>
#include <filesystem>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "check_table.h"
#include "settle.h"
#include "vest_tissue/modelling/bake.h"
#include "vest_tissue/scene/world.h"

namespace {

namespace fs = std::filesystem;

/// The source and its own parts, so that the scene's folder holds what it was made from.
void copySources(const vest::modelling::SceneSource& source, const fs::path& from,
                 const fs::path& directory) {
  fs::create_directories(directory);
  std::vector<fs::path> files{from.filename()};
  files.insert(files.end(), source.parts.begin(), source.parts.end());
  for (const fs::path& file : files) {
    const fs::path to = directory / file;
    if (fs::exists(to) && fs::equivalent(from.parent_path() / file, to)) continue;
    fs::create_directories(to.parent_path());
    fs::copy_file(from.parent_path() / file, to, fs::copy_options::overwrite_existing);
  }
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Makes nets from spline sources and checks scenes (docs/scene_format.md).");
  app.require_subcommand(1);

  std::string source_path, directory, materials_path = vest::tools::defaultMaterials();
  CLI::App* bake = app.add_subcommand("bake", "nets, skins and connections from a spline source");
  bake->add_option("SOURCE", source_path, "source.yaml")->required();
  bake->add_option("SCENE_DIR", directory,
                   "folder to write to, with a copy of the source (default: that of the source)");
  bake->add_option("--materials", materials_path, "material database")->capture_default_str();

  std::string scene_path;
  double seconds = 30.0;
  int threads = 1;
  CLI::App* settle = app.add_subcommand("settle", "lets a scene come to rest and writes the positions back");
  settle->add_option("SCENE", scene_path, "scene.yaml written by bake")->required();
  settle->add_option("--seconds", seconds, "give up after this simulated time")->capture_default_str();
  settle->add_option("--threads", threads, "worker threads")->capture_default_str();
  CLI::App* check = app.add_subcommand("check", "table of knots, springs, pieces, bindings, sub-steps");
  check->add_option("SCENE", scene_path, "scene.yaml")->required();

  CLI11_PARSE(app, argc, argv);
  try {
    if (bake->parsed()) {
      const fs::path path = fs::absolute(source_path);
      if (directory.empty()) directory = fs::path(source_path).parent_path().string();
      if (directory.empty()) directory = ".";
      const auto materials = vest::modelling::readMaterials(materials_path);
      const auto source = vest::modelling::readSource(source_path);
      if (source.name + ".yaml" == path.filename().string())
        throw std::invalid_argument(source_path + ": name: " + source.name +
                                    ": must differ from the file's name, which " + source.name +
                                    ".yaml would overwrite");
      const auto description = vest::modelling::bake(source, materials);
      copySources(source, path, directory);
      vest::modelling::writeScene(description, directory, path.filename().string());
      scene_path = directory + "/" + description.name + ".yaml";
    }
    auto description = vest::scene::loadScene(scene_path);
    if (settle->parsed()) {
      for (auto& object : description.objects) object.position = object.rest_position;
      vest::tools::settle(description, seconds, threads, true);
      vest::modelling::writeScene(description, description.directory, vest::modelling::sourceOf(scene_path));
      description = vest::scene::loadScene(scene_path);
    }
    return vest::tools::printCheck(description) ? 0 : 1;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "vest_model: %s\n", error.what());
    return 1;
  }
}
