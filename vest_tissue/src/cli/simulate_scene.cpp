#include "simulate_scene.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <stdexcept>

#include "settle.h"
#include "vest_tissue/fem/simulate.h"
#include "vest_tissue/scene/baked.h"

namespace vest::tools {
namespace {

constexpr double kMostWorldStep = 0.01;  // s, World::step
constexpr double kMostSettling = 100.0;  // s of simulated time until nets have to be at rest
constexpr double kRestSpeed = 0.0002;    // m/s: a fifth of what counts as at rest (docs/conventions.md)

void append(std::string& bytes, const std::vector<Eigen::Vector3d>& values) {
  bytes.append(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(Eigen::Vector3d));
}

/// Nets and rigid objects at the end.
struct Moved {
  std::vector<std::vector<Eigen::Vector3d>> positions;
  std::uint64_t hash = 0;
};

Moved moveNets(scene::Description nets, const SimulateOptions& o, double dt) {
  // A World takes steps of 0.01 s at most; longer ones of the scene are made of equal parts.
  const double parts = std::ceil(dt / kMostWorldStep * (1.0 - 1e-12));
  nets.dt = dt / std::max(1.0, parts);
  tellPreparing(nets);
  scene::World world(nets, o.threads);
  if (o.equilibrium) {
    for (Rest rest = run(world, 2.0, 0.0); !(rest.speed < kRestSpeed); rest = run(world, 2.0, 0.0)) {
      if (world.time() > kMostSettling) {
        throw std::runtime_error("not at rest after " + std::to_string(kMostSettling) + " s: " + rest.object +
                                 " moves");
      }
    }
  } else if (o.steps > 0) {
    run(world, static_cast<double>(o.steps) * dt * (1.0 - 1e-12), 0.0);
  }
  Moved moved;
  for (std::size_t k = 0; k < world.objectCount(); ++k) {
    std::vector<float> xyz(3 * world.knotCount(k));
    world.positions(k, xyz.data());
    std::vector<Eigen::Vector3d> x(world.knotCount(k));
    for (std::size_t i = 0; i < x.size(); ++i)
      x[i] = Eigen::Vector3d(xyz[3 * i], xyz[3 * i + 1], xyz[3 * i + 2]);
    moved.positions.push_back(std::move(x));
  }
  moved.hash = world.stateHash();
  return moved;
}

}  // namespace

SimulatedScene simulateScene(const scene::Description& description, const SimulateOptions& options) {
  SimulateOptions o = options;
  o.equilibrium = o.equilibrium || description.integrator == scene::Integrator::Static;
  const double dt = o.dt > 0.0 ? o.dt : description.dt;
  scene::Description nets = description;
  nets.objects.clear();
  bool any_fem = false;
  // The trainer's own integrator moves all objects together in a World: they touch and are connected.
  const bool together = !o.equilibrium && description.integrator == scene::Integrator::NewtonEuler;
  for (const auto& object : description.objects) {
    if (object.fem && !together) {
      any_fem = true;
      continue;
    }
    nets.objects.push_back(object);
  }
  for (const auto& connection : description.connections) {
    for (const auto& object : description.objects) {
      if (!together && object.fem &&
          (object.name == connection.object0 || object.name == connection.object1)) {
        throw std::invalid_argument("object '" + object.name +
                                    "': connections: 1; allowed: none between finite elements and others "
                                    "unless solution.integrator is "
                                    "newton_euler");
      }
    }
  }
  const bool any_net = !nets.objects.empty();
  const Moved moved = any_net ? moveNets(nets, o, dt) : Moved{};
  SimulatedScene result;
  std::string bytes;
  if (any_net) bytes.append(reinterpret_cast<const char*>(&moved.hash), sizeof moved.hash);
  std::size_t net = 0;
  for (const auto& object : description.objects) {
    if (object.fem && !together) {
      fem::Options f;
      f.equilibrium = o.equilibrium;
      f.steps = static_cast<int>(o.steps);
      f.dt = dt;
      f.gravity = description.gravity;
      f.threads = o.threads;
      const fem::Result r = fem::simulate(*object.fem, f);
      append(bytes, r.positions);
      append(bytes, r.velocities);
      result.names.push_back(object.name);
      result.positions.push_back(r.positions);
      continue;
    }
    result.names.push_back(object.name);
    result.positions.push_back(moved.positions[net++]);
  }
  char digits[17];
  std::snprintf(digits, sizeof digits, "%016llx", static_cast<unsigned long long>(moved.hash));
  result.hash = any_fem ? scene::hashText(bytes) : digits;
  return result;
}

void writePositions(const SimulatedScene& scene, const std::string& path) {
  std::FILE* file = std::fopen(path.c_str(), "w");
  if (file == nullptr) throw std::runtime_error("--output: " + path + " cannot be written");
  std::fprintf(file, "object,node,x,y,z\n");
  for (std::size_t k = 0; k < scene.names.size(); ++k) {
    for (std::size_t n = 0; n < scene.positions[k].size(); ++n) {
      const Eigen::Vector3d& x = scene.positions[k][n];
      std::fprintf(file, "%s,%zu,%.17g,%.17g,%.17g\n", scene.names[k].c_str(), n, x.x(), x.y(), x.z());
    }
  }
  const bool good = std::ferror(file) == 0;
  if (std::fclose(file) != 0 || !good) throw std::runtime_error("--output: " + path + " cannot be written");
}

}  // namespace vest::tools
