#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "vest_tissue/scene/world.h"

namespace vest::tools {

struct SimulateOptions {
  std::uint64_t steps = 0;
  double dt = 0.0;           ///< s (or the scene's unit of time); 0: the scene's
  bool equilibrium = false;  ///< --static, or the scene's integrator
  int threads = 1;
};

struct SimulatedScene {
  std::vector<std::string> names;                       ///< scene order
  std::vector<std::vector<Eigen::Vector3d>> positions;  ///< at the end
  std::string hash;  ///< 16 digits; World::stateHash() where there are nets alone, else XXH64 over that and
                     ///< the positions and velocities of elastostatic objects
};

/// Elastostatic objects each by fem::simulate, nets together in a World.
/// @throws std::invalid_argument naming object, field, value, what is allowed; std::runtime_error where no
/// end is reached
SimulatedScene simulateScene(const scene::Description& description, const SimulateOptions& options);

/// object,node,x,y,z. @throws std::runtime_error if it cannot be written
void writePositions(const SimulatedScene& scene, const std::string& path);

}  // namespace vest::tools
