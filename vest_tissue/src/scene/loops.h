#pragma once

#include "stages.h"

/// Loops that are tied beforehand: they lie in packets until a pusher takes them, and then run in it.
namespace vest::scene {

/// Supports of what lies in packets and pushers and of what a pusher's point meets, behind all others, for a
/// part between two fractions of a step.
void holdLoops(Context& c, double from, double to);
/// Whether a thread lies in its packet or runs in a pusher.
bool inPusher(const Context& c, std::size_t thread);
/// Whether a segment leaves the instrument's point, or lies before it: its capsules do not touch it.
bool atPusher(const Context& c, int tool, std::uint32_t segment);

}  // namespace vest::scene
