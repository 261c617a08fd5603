#pragma once

#include <cstdint>
#include <string>

#include "simulate_scene.h"
#include "vest_tissue/scene/rod_scene.h"

namespace vest::tools {

/// Tables that are written while rods move.
struct RodTables {
  std::string reactions, path;  ///< files; empty: none
  std::uint64_t every = 1;      ///< steps from one time to the next
};

/// Steps, or equilibrium; beside other objects in a World, whose equilibrium is where nothing moves any more.
/// Tables begin with the start, but where the equilibrium is sought: they then hold it
/// alone. @throws std::invalid_argument, std::runtime_error
SimulatedScene simulateRods(const scene::RodScene& scene, const SimulateOptions& options,
                            const RodTables& tables);

}  // namespace vest::tools
