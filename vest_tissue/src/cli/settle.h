#pragma once

#include <string>
#include <vector>

#include "vest_tissue/scene/world.h"

namespace vest::tools {

struct Rest {
  double speed = 0.0;             ///< m/s, the greatest of a knot
  std::string object;             ///< its
  double seconds_per_step = 0.0;  ///< wall time
  double seconds = 0.0;           ///< simulated
};
/// Says on standard error what a World prepares for long, each twentieth of the work.
void tellPreparing(scene::Description& description);

/// Steps without any tool.
/// @param watch_from s, from when on speeds are seen
/// @param patience s of processor time: then it ends early
/// @throws std::runtime_error if the World reports a fault
Rest run(scene::World& world, double seconds, double watch_from, double patience = 1e30);

/// Positions of all knots as they are now, and the offsets of connections, which turn with what carries them.
void readPositions(const scene::World& world, scene::Description& description);

/// Positions of all knots, and offsets of connections, as they are without load.
void startAtRest(scene::Description& description);

/// Lets a scene come to rest under gravity and puts the result into description.position; rest lengths stay.
/// A World that is made of the result stays at rest: what lies on each other there belongs together (docs/
/// decisions/0015), so it is made again from where it rests, until that moves nothing.
/// @throws std::invalid_argument if an object would fall for ever, std::runtime_error if it does not come to
/// rest within `seconds`
void settle(scene::Description& description, double seconds, int threads, bool verbose);

}  // namespace vest::tools
