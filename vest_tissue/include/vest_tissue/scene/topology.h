#pragma once

#include <array>
#include <cstdint>

#include <Eigen/Core>

#include "vest_tissue/scene/world_state.h"

namespace vest::scene {

/// Primitives of every cut. Each changes the State and adds to the delta, which beginDelta starts and
/// endDelta finishes: that counts the object's and the world's revision up. They allocate nothing while the
/// room that a World reserves lasts (a quarter more knots and links).
void beginDelta(const WorldState& state, std::uint16_t object, TopologyDelta& delta);
TopologyDelta beginDelta(const WorldState& state, std::uint16_t object);
/// The link dies: its place stays, it exerts no force any more. False if it does not exist or is dead.
bool removeLink(WorldState& state, std::uint16_t object, std::uint32_t link, TopologyDelta& delta);
/// removeLink, and a fold over the edge that it was, or one whose wing hung by it alone, bears no moment any
/// more.
bool tearLink(WorldState& state, std::uint16_t object, std::uint32_t link, TopologyDelta& delta);
/// P -> P, P': the copy has `share` (0 … 1, no unit) of the mass and of the tethers, the same place and
/// velocity and no links yet. The masses' sum stays, to the last bit. False when the spare room is used up.
/// Anchors are moved by net::remap.
bool doubleKnot(WorldState& state, std::uint16_t object, std::uint32_t knot, std::uint32_t& copy,
                TopologyDelta& delta, double share = 0.5);
/// A new link between other knots with `share` of a link's area, stiffness and damping and its rest length.
/// False when the spare room is used up.
bool addLinkLike(WorldState& state, std::uint16_t object, std::uint32_t link,
                 const std::array<std::uint32_t, 3>& knots, double share, TopologyDelta& delta);
/// Moves one end of a living link from a knot to its copy: the link dies, a new one with its numbers is
/// added.
bool moveLinkEnd(WorldState& state, std::uint16_t object, std::uint32_t link, std::uint32_t from,
                 std::uint32_t to, TopologyDelta& delta);
/// doubleKnot, and what lies on the side of the plane through the knot to which `normal` (length > 0) points
/// goes to the copy: links, hinges, contact triangles, the skin's binding, and the anchors of grasps and
/// connections. Mass and tethers go with the share of links and triangles. A hinge across the split, or over
/// an edge that no link is left of, or with a wing that no link holds any more, dies. Enclosed volumes keep
/// the original, so that they stay closed. False, and nothing has changed: no such knot, no room, or all of
/// its tissue lies on one side.
bool splitKnot(WorldState& state, std::uint16_t object, std::uint32_t knot, const Eigen::Vector3d& normal,
               std::uint32_t& copy, TopologyDelta& delta);
/// What holds on to an object goes to its side of a knot that was doubled: clips and slings; and with them
/// connections and grasps.
void remapFasteners(WorldState& state, std::uint16_t object, const net::KnotDoubling& cut);
void remapAnchors(WorldState& state, std::uint16_t object, const net::KnotDoubling& cut);
/// A contact triangle has other knots: nodes of slings that lie on it, around no ring, have them too.
void followTriangle(WorldState& state, std::uint16_t object, const std::array<std::uint32_t, 3>& before,
                    const std::array<std::uint32_t, 3>& now);
void endDelta(WorldState& state, TopologyDelta& delta);

/// What a reader does: the topology of delta.object before becomes that afterwards, exactly. False, and
/// nothing has changed, where the delta does not start from this revision of the object or names what it does
/// not have.
bool applyDelta(Topology& topology, const TopologyDelta& delta);

/// Knot of the scene of which a knot is a copy (of a copy …); itself where it is none.
std::uint32_t originalKnot(const Topology& topology, std::size_t scene_knots, std::uint32_t knot);

}  // namespace vest::scene
