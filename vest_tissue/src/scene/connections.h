#pragma once

#include "stages.h"

namespace vest::scene {

/// Where an anchor holds its object (m, world); on the face, without the height.
Eigen::Vector3d footOf(const WorldState& state, const net::Anchor& a);
/// Of each connection (1/s², 1/s): what a force at its ends does to it, and what all others that hold the
/// same knots do, levers included.
std::vector<solver::Rates> connectionRates(const Description& d, const WorldState& state);

/// m: by how much a connection is stretched, from end 0 to end 1.
Eigen::Vector3d stretchOf(const WorldState& state, const ConnectionState& s, const ConnectionConstants& k);
/// Gives the face of end 1 as much of the offset (m, world) to carry as its corners bear as a lever; the rest
/// is a strand. False: there is no face.
bool carryOffset(const WorldState& state, ConnectionState& s, const Eigen::Vector3d& offset,
                 ConnectionConstants& k);
/// Adds the forces of connection n to the held forces of the ends that begin a batch of `h` s; where `renew`
/// they are found anew, else as they were.
void exchange(Context& c, std::size_t n, double h, bool renew, bool due0, bool due1);
/// A connection that a blade or a pull severed: no more of it, a delta without entries, and an event.
void sever(Context& c, std::size_t n, double force, int instrument);

}  // namespace vest::scene
