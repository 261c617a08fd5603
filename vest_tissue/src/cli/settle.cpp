#include "settle.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <stdexcept>
#include <vector>

#include <Eigen/Geometry>

#include "vest_instruments/files/refusal.h"
#include "vest_tissue/scene/falling.h"
#include "vest_tissue/scene/world_model.h"
#include "vest_tissue/scene/world_state.h"

namespace vest::tools {
namespace {
constexpr double kRestSpeed = 0.001;  // m/s: what counts as at rest (docs/conventions.md)
}

void tellPreparing(scene::Description& description) {
  description.preparing = [told = -1](const std::string& object, double share) mutable {
    const int part = static_cast<int>(20 * share);
    if (part == told) return;
    told = part;
    std::fprintf(stderr, "preparing %s: %d %%\n", files::shown(object, 100).c_str(), 5 * part);
  };
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
  for (std::size_t n = 0; n < description.connections.size(); ++n) {
    const scene::ConnectionState& s = world.state().connections[n];
    if (!s.alive) continue;
    const auto at = [&](const net::Anchor& a, std::size_t i) { return world.knotAt(a.object, a.knots[i]); };
    const net::Anchor& face = s.end1;
    Eigen::Vector3d place = Eigen::Vector3d::Zero(), foot = place;
    for (std::size_t i = 0; i < 4; ++i)
      if (face.weights[i] != 0.0) place += face.weights[i] * at(face, i);
    if (face.height != 0.0)
      place += face.height * (at(face, 1) - at(face, 0)).cross(at(face, 2) - at(face, 0)).normalized();
    scene::Connection& c = description.connections[n];
    for (std::size_t i = 0; i < 3; ++i) foot += c.weights1[i] * world.knotAt(face.object, c.triangle1[i]);
    // What the face does not carry is a strand, which points to the knot.
    const Eigen::Vector3d way = at(s.end0, 0) - place;
    const double length = way.norm();
    c.offset = place - foot;
    if (length > 0.0) c.offset += world.model().connections[n].strand / length * way;
  }
}

void startAtRest(scene::Description& description) {
  for (auto& object : description.objects) object.position = object.rest_position;
  const auto named = [&](const std::string& name) -> const scene::Object& {
    return *std::find_if(description.objects.begin(), description.objects.end(),
                         [&](const scene::Object& o) { return o.name == name; });
  };
  for (scene::Connection& c : description.connections) {
    c.offset = named(c.object0).rest_position[c.knot0];
    for (std::size_t i = 0; i < 3; ++i)
      c.offset -= c.weights1[i] * named(c.object1).rest_position[c.triangle1[i]];
  }
}

void settle(scene::Description& description, double seconds, int threads, bool verbose) {
  const std::string falling = scene::fallingSentence(description);
  if (!falling.empty()) throw std::invalid_argument(falling);
  constexpr double kWindow = 2.0;          // s
  constexpr double kWell = 0.7;            // of the speed of rest, so that a reloaded scene passes too
  scene::Description quiet = description;  // at rest: nothing contracts
  for (auto& object : quiet.objects) object.motility = {};
  double passed = 0;
  for (bool still = false; !still;) {
    scene::World world(quiet, threads);
    Rest rest;
    for (bool first = true;; first = false) {
      rest = run(world, kWindow, 0.0);
      passed += kWindow;
      if (verbose) {
        std::printf("%5.1f s: greatest speed of the last 2 s %8.3f mm/s (%s), %.0f us a step\n", passed,
                    1000 * rest.speed, rest.object.c_str(), 1e6 * rest.seconds_per_step);
        std::fflush(stdout);
      }
      still = first && rest.speed < kWell * kRestSpeed;
      if (still || rest.speed < kWell * kRestSpeed) break;
      if (passed >= seconds)
        throw std::runtime_error("not at rest after " + std::to_string(passed) + " s: " + rest.object +
                                 " moves");
    }
    if (!still) readPositions(world, quiet);
  }
  for (std::size_t o = 0; o < quiet.objects.size(); ++o)
    description.objects[o].position = quiet.objects[o].position;
  description.connections = quiet.connections;
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
