#include <cstdio>
#include <exception>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "check_table.h"
#include "edit_source.h"
#include "library_commands.h"
#include "settle.h"
#include "vest_instruments/files/option.h"
#include "vest_instruments/files/refusal.h"
#include "vest_tissue/modelling/bake.h"
#include "vest_tissue/modelling/copy_parts.h"
#include "vest_tissue/scene/world.h"

namespace {

namespace fs = std::filesystem;

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

  std::string script_path, object;
  double within = 0.004;
  CLI::App* edit = app.add_subcommand("edit", "edits of a file, applied to a source (docs/modelling.md)");
  CLI::App* propose = app.add_subcommand("propose", "edits that tie an object to what lies near it");
  for (CLI::App* command : {edit, propose}) {
    command->add_option("SOURCE", source_path, "source.yaml")->required();
    command->add_option("--materials", materials_path, "material database")->capture_default_str();
  }
  edit->add_option("--script", script_path, "file of edits")->required();
  edit->add_option("-o,--output", directory,
                   "folder to write to: source, scene and nets (default: that of the source)");
  propose->add_option("OBJECT", object, "name of an object")->required();
  propose->add_option("--within", within, "m, from its knots to another object's surface")
      ->check(vest::files::number(0, 10))
      ->capture_default_str();

  std::string kind, name, as;
  std::vector<double> by;
  CLI::App* list = app.add_subcommand("list", "what VEST ships: parts, scenes, materials, tables, textures");
  CLI::App* show = app.add_subcommand("show", "one entry of it: where it is from, its licence, its objects");
  for (CLI::App* command : {list, show})
    command->add_option("--kind", kind, "part, scene, material, table or texture")
        ->check(CLI::IsMember({"part", "scene", "material", "table", "texture"}));
  show->add_option("NAME", name)->required();
  CLI::App* add = app.add_subcommand("add", "puts a part of the library into a source (docs/modelling.md)");
  add->add_option("SOURCE", source_path, "source.yaml")->required();
  add->add_option("NAME", name, "of the part")->required();
  add->add_option("--as", as, "name of its object (default: that of the part)");
  add->add_option("--by", by, "m, x y z: so far from where the part says")
      ->expected(3)
      ->check(vest::files::number(-10, 10));
  add->add_option("-o,--output", directory, "folder to write to (default: that of the source)");
  add->add_option("--materials", materials_path, "material database")->capture_default_str();

  std::string scene_path;
  double seconds = 30.0;
  int threads = 1;
  CLI::App* settle = app.add_subcommand("settle", "lets a scene come to rest and writes the positions back");
  settle->add_option("SCENE", scene_path, "scene.yaml written by bake")->required();
  settle->add_option("--seconds", seconds, "give up after this simulated time")
      ->check(vest::files::number(0, 1e6))
      ->capture_default_str();
  settle->add_option("--threads", threads, "worker threads")->check(CLI::Range(1, 64))->capture_default_str();
  CLI::App* check = app.add_subcommand(
      "check",
      "of a scene: table of knots, springs, pieces, bindings, sub-steps. Without one: of the library");
  const CLI::Option* const checked = check->add_option("SCENE", scene_path, "scene.yaml");

  CLI11_PARSE(app, argc, argv);
  try {
    if (bake->parsed()) {
      const fs::path path = fs::absolute(source_path);
      if (directory.empty()) directory = fs::path(source_path).parent_path().string();
      if (directory.empty()) directory = ".";
      const auto materials = vest::modelling::readMaterials(materials_path);
      const auto source = vest::modelling::readSource(source_path);
      // A scene lies beside its source and its parts.
      std::error_code error;
      const bool beside = fs::equivalent(directory, path.parent_path(), error);
      vest::modelling::writeScene(vest::modelling::bake(source, materials), directory,
                                  path.filename().string(),
                                  beside ? "" : vest::files::read(source_path, 4u << 20));
      if (!beside) vest::modelling::copyParts(source, path.parent_path().string(), directory);
      scene_path = directory + "/" + source.name + ".yaml";
    }
    if (list->parsed()) {
      vest::tools::printLibrary(vest::modelling::readLibrary(), kind);
      return 0;
    }
    if (show->parsed()) {
      vest::tools::printEntry(vest::modelling::find(vest::modelling::readLibrary(), name, kind));
      return 0;
    }
    if (check->parsed() && checked->count() == 0)
      return vest::tools::checkLibrary(vest::modelling::readLibrary()) ? 0 : 1;
    if (propose->parsed()) {
      vest::tools::printProposals(source_path, object, within,
                                  vest::modelling::readMaterials(materials_path));
      return 0;
    }
    if (edit->parsed()) {
      if (directory.empty()) directory = fs::absolute(source_path).parent_path().string();
      scene_path = vest::tools::editSource(source_path, script_path, directory,
                                           vest::modelling::readMaterials(materials_path));
    }
    if (add->parsed()) {
      if (directory.empty()) directory = fs::absolute(source_path).parent_path().string();
      const auto library = vest::modelling::readLibrary();
      scene_path = vest::tools::addPart(source_path, vest::modelling::find(library, name, "part"), as, by,
                                        directory, vest::modelling::readMaterials(materials_path));
    }
    auto description = vest::scene::loadScene(scene_path);
    if (edit->parsed() || add->parsed())
      std::printf("%s: scene %s\n", vest::files::shown(scene_path, 6000).c_str(), description.hash.c_str());
    if (settle->parsed()) {
      vest::tools::startAtRest(description);
      vest::tools::settle(description, seconds, threads, true);
      if (description.source.empty())
        throw std::invalid_argument(scene_path +
                                    ": source: missing: only a scene that bake wrote can be settled");
      vest::modelling::writeScene(description, description.directory, description.source);
      description = vest::scene::loadScene(scene_path);
    }
    const std::string fault = vest::tools::printCheck(description);
    return vest::tools::printVerdict({fault, vest::tools::startFault(description)}) ? 0 : 1;
  } catch (const std::exception& error) {
    std::fflush(stdout);  // what is wrong is the last line
    const std::string& of = scene_path.empty() ? source_path : scene_path;
    std::fprintf(stderr, "vest_model: %s\n",
                 of.empty() ? error.what() : vest::files::refusal(error.what(), of).c_str());
    return 1;
  }
}
