#include "settle.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <stdexcept>

#include "vest_tissue/scene/falling.h"

namespace vest::tools {
namespace {
constexpr double kRestSpeed = 0.001;  // m/s: what counts as at rest (docs/conventions.md)
}

Rest run(scene::World& world, double seconds, double watch_from, double patience) {
  scene::StepInput input;
  input.dt = world.description().dt;
  scene::StepReport report;
  Rest rest;
  std::vector<float> velocity;
  const auto begin = std::chrono::steady_clock::now();
  const auto steps = static_cast<std::uint64_t>(std::llround(seconds / input.dt));
  const std::clock_t spent = std::clock();
  std::uint64_t done = 0;
  for (std::uint64_t i = 0; i < steps; ++i, ++done) {
    if (static_cast<double>(std::clock() - spent) > patience * CLOCKS_PER_SEC) break;
    input.step = world.steps();
    if (world.step(input, report) == scene::Status::Fault) {
      throw std::runtime_error("fault in " + std::string(report.fault_object) + " after " +
                               std::to_string(world.time()) + " s");
    }
    if (static_cast<double>(i) * input.dt < watch_from || i % 10 != 0) continue;
    for (std::size_t o = 0; o < world.objectCount(); ++o) {
      velocity.resize(3 * world.knotCount(o));
      world.velocities(o, velocity.data());
      for (std::size_t k = 0; k < world.knotCount(o); ++k) {
        const double speed =
            std::sqrt(velocity[3 * k] * velocity[3 * k] + velocity[3 * k + 1] * velocity[3 * k + 1] +
                      velocity[3 * k + 2] * velocity[3 * k + 2]);
        if (speed > rest.speed) {
          rest.speed = speed;
          rest.object = world.description().objects[o].name;
        }
      }
    }
  }
  rest.seconds_per_step = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count() /
                          static_cast<double>(std::max<std::uint64_t>(done, 1));
  rest.seconds = static_cast<double>(done) * input.dt;
  return rest;
}

void readPositions(const scene::World& world, scene::Description& description) {
  std::vector<float> xyz;
  for (std::size_t o = 0; o < world.objectCount(); ++o) {
    auto& object = description.objects[o];
    if (object.model == scene::ObjectModel::Rigid) continue;
    xyz.resize(3 * world.knotCount(o));
    world.positions(o, xyz.data());
    for (std::size_t k = 0; k < object.position.size(); ++k) {
      if (!object.fixed[k]) object.position[k] = Eigen::Vector3d(xyz[3 * k], xyz[3 * k + 1], xyz[3 * k + 2]);
    }
  }
}

void settle(scene::Description& description, double seconds, int threads, bool verbose) {
  const std::string falling = scene::fallingSentence(description);
  if (!falling.empty()) throw std::invalid_argument(falling);
  scene::Description quiet = description;  // at rest: nothing contracts
  for (auto& object : quiet.objects) object.motility = {};
  scene::World world(quiet, threads);
  double passed = 0;
  for (;;) {
    const Rest rest = run(world, 2.0, 0.0);
    passed += 2.0;
    if (verbose) {
      std::printf("%5.1f s: greatest speed of the last 2 s %8.3f mm/s (%s), %.0f us a step\n", passed,
                  1000 * rest.speed, rest.object.c_str(), 1e6 * rest.seconds_per_step);
      std::fflush(stdout);
    }
    if (rest.speed < 0.2 * kRestSpeed) break;  // well below, so that a reloaded scene passes too
    if (passed >= seconds)
      throw std::runtime_error("not at rest after " + std::to_string(passed) + " s: " + rest.object +
                               " moves");
  }
  readPositions(world, description);
  if (!verbose) return;
  for (const auto& object : description.objects) {
    double most = 0, mean = 0;
    for (std::size_t k = 0; k < object.position.size(); ++k) {
      const double moved = (object.position[k] - object.rest_position[k]).norm();
      most = std::max(most, moved);
      mean += moved / static_cast<double>(object.position.size());
    }
    std::printf("%-22s moved %5.2f mm on the mean, %5.2f mm at most\n", object.name.c_str(), 1000 * mean,
                1000 * most);
  }
}

}  // namespace vest::tools
