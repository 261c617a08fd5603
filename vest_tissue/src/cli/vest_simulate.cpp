#include <cstdio>
#include <exception>
#include <string>

#include <CLI/CLI.hpp>

#include "simulate_rods.h"
#include "simulate_scene.h"
#include "vest_instruments/files/option.h"
#include "vest_instruments/files/refusal.h"

namespace {
constexpr double kShortestStep = 1e-9;  // s (assumed): steps of less move nothing
constexpr double kLongestStep = 1000;  // s (assumed): of static and backward Euler scenes in other units, too
}  // namespace

int main(int argc, char** argv) {
  CLI::App app(
      "Simulates a scene without instruments and writes where its nodes end (docs/scene_format.md).");
  std::string scene_path, output;
  vest::tools::SimulateOptions options;
  options.steps = 1000;
  bool hash = false;
  app.add_option("SCENE", scene_path, "scene.yaml")->required();
  app.add_option("--steps", options.steps, "steps of dt")
      ->check(CLI::Range(0, 1000000000))
      ->capture_default_str();
  app.add_option("--dt", options.dt, "step, s (default: the scene's)")
      ->check(vest::files::number(kShortestStep, kLongestStep));
  app.add_flag("--static", options.equilibrium, "equilibrium instead of steps");
  app.add_option("--threads", options.threads, "threads; results are the same for any")
      ->check(CLI::Range(1, 64))
      ->capture_default_str();
  app.add_option("--output", output, "CSV: object,node,x,y,z");
  vest::tools::RodTables tables;
  app.add_option("--reactions", tables.reactions,
                 "CSV: t,object,node,fx,fy,fz,mx,my,mz of every held node of rods, holder on rod");
  app.add_option("--path", tables.path, "CSV: t,object,node,x,y,z of every node of rods");
  app.add_option("--every", tables.every, "steps from one time in those tables to the next")
      ->check(CLI::Range(1, 1000000000))
      ->capture_default_str();
  app.add_flag("--hash", hash, "print scene_hash and state_hash");
  CLI11_PARSE(app, argc, argv);
  try {
    vest::tools::SimulatedScene result;
    std::string scene_hash;
    if (vest::scene::hasRods(scene_path)) {
      const auto rods = vest::scene::loadRods(scene_path);
      result = vest::tools::simulateRods(rods, options, tables);
      scene_hash = rods.hash;
    } else {
      if (!tables.reactions.empty() || !tables.path.empty())
        throw std::invalid_argument("--reactions and --path are for scenes of rods, and there is none");
      const auto description = vest::scene::loadScene(scene_path);
      result = vest::tools::simulateScene(description, options);
      scene_hash = description.hash;
    }
    if (!output.empty()) vest::tools::writePositions(result, output);
    if (hash) std::printf("scene_hash %s\nstate_hash %s\n", scene_hash.c_str(), result.hash.c_str());
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "vest_simulate: %s\n", vest::files::refusal(error.what(), scene_path).c_str());
    return 1;
  }
}
