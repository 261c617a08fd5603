#include <cstdio>
#include <exception>
#include <fstream>
#include <stdexcept>
#include <string>

#include <CLI/CLI.hpp>

#include "settle.h"
#include "vest_tissue/scene/world.h"

namespace {

void writePositions(const vest::scene::World& world, const std::string& path) {
  std::ofstream file(path);
  file << "object,node,x,y,z\n";
  std::vector<float> xyz;
  char line[160];
  for (std::size_t o = 0; o < world.objectCount(); ++o) {
    xyz.resize(3 * world.knotCount(o));
    world.positions(o, xyz.data());
    for (std::size_t k = 0; k < world.knotCount(o); ++k) {
      std::snprintf(line, sizeof line, ",%zu,%.9g,%.9g,%.9g\n", k, xyz[3 * k], xyz[3 * k + 1],
                    xyz[3 * k + 2]);
      file << world.description().objects[o].name << line;
    }
  }
  file.close();
  if (!file) throw std::runtime_error(path + ": cannot be written");
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Simulates a scene without instruments (docs/scene_format.md).");
  std::string scene, output;
  unsigned long steps = 1000;
  double dt = 0.0;
  bool to_rest = false, hash = false;
  int threads = 1;
  app.add_option("SCENE", scene, "scene.yaml")->required();
  app.add_option("--steps", steps, "number of steps")->capture_default_str();
  app.add_option("--dt", dt, "s a step, 1e-6 to 0.01 (default: the scene's)")->check(CLI::Range(1e-6, 0.01));
  app.add_flag("--static", to_rest,
               "go on until all is at rest (every knot under 0.2 mm/s for 2 s, at most 100 s)");
  app.add_option("--threads", threads, "worker threads")->capture_default_str()->check(CLI::Range(1, 64));
  app.add_option("--output", output, "CSV of the positions at the end: object,node,x,y,z");
  app.add_flag("--hash", hash, "print scene_hash and state_hash");
  CLI11_PARSE(app, argc, argv);
  try {
    auto description = vest::scene::loadScene(scene);
    if (dt > 0) description.dt = dt;
    vest::scene::World world(description, threads);
    vest::tools::Rest rest;
    if (to_rest) {
      do {
        rest = vest::tools::run(world, 2.0, 0.0);
        if (world.time() > 100)
          throw std::runtime_error(scene + ": not at rest after 100 s: " + rest.object + " moves");
      } while (!(rest.speed < 0.0002));
    } else {
      rest = vest::tools::run(world, static_cast<double>(steps) * description.dt, 0.0);
    }
    std::printf("%llu steps of %g s, greatest speed %.4f mm/s, %.0f us a step\n",
                static_cast<unsigned long long>(world.steps()), description.dt, 1000 * rest.speed,
                1e6 * rest.seconds_per_step);
    if (hash) {
      std::printf("scene_hash %s\nstate_hash %016llx\n", description.hash.c_str(),
                  static_cast<unsigned long long>(world.stateHash()));
    }
    if (!output.empty()) writePositions(world, output);
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "vest_simulate: %s\n", error.what());
    return 1;
  }
}
