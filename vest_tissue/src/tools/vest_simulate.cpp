#include <cstdio>
#include <exception>
#include <string>

#include <CLI/CLI.hpp>

#include "simulate_scene.h"

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
  app.add_option("--dt", options.dt, "step, s (default: the scene's)")->check(CLI::PositiveNumber);
  app.add_flag("--static", options.equilibrium, "equilibrium instead of steps");
  app.add_option("--threads", options.threads, "threads; results are the same for any")
      ->check(CLI::Range(1, 64))
      ->capture_default_str();
  app.add_option("--output", output, "CSV: object,node,x,y,z");
  app.add_flag("--hash", hash, "print scene_hash and state_hash");
  CLI11_PARSE(app, argc, argv);
  try {
    const auto description = vest::scene::loadScene(scene_path);
    const auto result = vest::tools::simulateScene(description, options);
    if (!output.empty()) vest::tools::writePositions(result, output);
    if (hash) std::printf("scene_hash %s\nstate_hash %s\n", description.hash.c_str(), result.hash.c_str());
    return 0;
  } catch (const std::exception& error) {
    const std::string message = error.what();
    const bool named = message.compare(0, scene_path.size(), scene_path) == 0;
    std::fprintf(stderr, "vest_simulate: %s%s\n", named ? "" : (scene_path + ": ").c_str(), message.c_str());
    return 1;
  }
}
