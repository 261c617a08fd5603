#pragma once

#include <optional>
#include <string>

#include "vest_tissue/scene/description.h"
#include "vest_tissue/suture/description.h"

namespace vest::scene {

/// A scene of objects with `model: rod` or `cylinder` (docs/scene_format.md). Any consistent unit system.
struct RodScene {
  std::string hash;  ///< as Description::hash
  double dt = 0.001;
  bool equilibrium = false;     ///< solution: {integrator: static}
  suture::Description objects;  ///< rods in scene order, cylinders in scene order
  /// Where a scene has nets, elements or rigid objects, too: they and the rods, as sutures, for a World. SI
  /// units. Its integrator is Integrator::NewtonEuler, and its dt is that of the scene, which may be longer
  /// than a World's.
  std::optional<Description> together;
};

/// True if the file is a scene in which an object is a rod or a cylinder. @throws std::invalid_argument as
/// loadScene()
bool hasRods(const std::string& path);

/// @throws std::invalid_argument: file, line, field, value, what is allowed
RodScene loadRods(const std::string& path);

}  // namespace vest::scene
