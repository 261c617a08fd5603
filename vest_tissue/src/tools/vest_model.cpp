#include <cmath>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <stdexcept>
#include <string>

#include <CLI/CLI.hpp>

#include "check_table.h"
#include "settle.h"
#include "vest_instruments/files/read.h"
#include "vest_tissue/modelling/bake.h"
#include "vest_tissue/scene/world.h"

namespace {

std::string directoryOf(const std::string& path) {
  const auto slash = path.find_last_of('/');
  return slash == std::string::npos ? "." : path.substr(0, slash);
}

std::string fileOf(const std::string& path) {
  return path.substr(path.find_last_of('/') + 1);
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Makes nets from spline sources and checks scenes (docs/scene_format.md).");
  app.require_subcommand(1);

  std::string source_path, directory, materials_path = vest::tools::defaultMaterials();
  CLI::App* bake = app.add_subcommand("bake", "nets, skins and connections from a spline source");
  bake->add_option("SOURCE", source_path, "source.yaml")->required();
  bake->add_option("SCENE_DIR", directory, "folder to write to (default: that of the source)");
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
      if (directory.empty()) directory = directoryOf(source_path);
      const auto materials = vest::modelling::readMaterials(materials_path);
      const auto description = vest::modelling::bake(vest::modelling::readSource(source_path), materials);
      // A scene lies beside its source.
      std::error_code error;
      const bool beside = std::filesystem::equivalent(directory, directoryOf(source_path), error);
      vest::modelling::writeScene(description, directory, fileOf(source_path),
                                  beside ? "" : vest::files::read(source_path, 4u << 20));
      scene_path = directory + "/" + description.name + ".yaml";
    }
    auto description = vest::scene::loadScene(scene_path);
    if (settle->parsed()) {
      for (auto& object : description.objects) object.position = object.rest_position;
      vest::tools::settle(description, seconds, threads, true);
      if (description.source.empty())
        throw std::invalid_argument(scene_path +
                                    ": source: missing: only a scene that bake wrote can be settled");
      vest::modelling::writeScene(description, description.directory, description.source);
      description = vest::scene::loadScene(scene_path);
    }
    const bool good = vest::tools::printCheck(description);
    return vest::tools::startsWell(description) && good ? 0 : 1;
  } catch (const std::exception& error) {
    const std::string message = error.what();
    const bool named = message.compare(0, scene_path.size(), scene_path) == 0 ||
                       message.find(directoryOf(scene_path) + "/") == 0 || scene_path.empty();
    std::fprintf(stderr, "vest_model: %s%s\n", named ? "" : (scene_path + ": ").c_str(), message.c_str());
    return 1;
  }
}
