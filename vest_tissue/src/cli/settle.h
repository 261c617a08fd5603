#pragma once

#include <string>
#include <vector>

#include "vest_tissue/scene/world.h"

namespace vest::tools {

/// Steps without any tool. Returns the greatest speed of a knot seen from `watch_from` s on, m/s, and its
/// object.
/// @throws std::runtime_error if the World reports a fault
struct Rest {
  double speed = 0.0;
  std::string object;
  double seconds_per_step = 0.0;  ///< wall time
};
Rest run(scene::World& world, double seconds, double watch_from);

/// Positions of all knots as they are now.
void readPositions(const scene::World& world, scene::Description& description);

/// Lets a scene come to rest under gravity and puts the result into description.position; rest lengths stay.
/// @throws std::invalid_argument if an object would fall for ever, std::runtime_error if it does not come to
/// rest within `seconds`
void settle(scene::Description& description, double seconds, int threads, bool verbose);

}  // namespace vest::tools
