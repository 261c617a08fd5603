#pragma once

#include <cstdint>

#include "vest_tissue/scene/world_state.h"

namespace vest::scene {

/// Primitives of every cut. Each changes the State, counts the object's and the world's revision up and adds to the
/// delta, whose from_revision … object_revision the caller finishes with endDelta. Not real-time safe yet: the delta and
/// the topology's lists grow.
TopologyDelta beginDelta(const WorldState& state, std::uint16_t object);
/// The link dies: its place stays, it exerts no force any more. False if it does not exist or is dead.
bool removeLink(WorldState& state, std::uint16_t object, std::uint32_t link, TopologyDelta& delta);
/// P -> P, P': the copy has half of the mass, the same place and velocity and no links yet. False when the spare room is
/// used up. Anchors are moved by net::remap.
bool doubleKnot(WorldState& state, std::uint16_t object, std::uint32_t knot, std::uint32_t& copy, TopologyDelta& delta);
/// Moves one end of a living link from a knot to its copy: the link dies, a new one with its numbers is added.
bool moveLinkEnd(WorldState& state, std::uint16_t object, std::uint32_t link, std::uint32_t from, std::uint32_t to,
                 TopologyDelta& delta);
void endDelta(WorldState& state, TopologyDelta& delta);

}  // namespace vest::scene
