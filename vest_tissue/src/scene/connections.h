#pragma once

#include "stages.h"

namespace vest::scene {

/// Where an anchor's face carries its end: at sum of weights·knots + height·normal. The weights may lie
/// beyond the face (sum 1), so that the place turns with it as a rigid lever does.
struct Face {
  Eigen::Vector3d corner = Eigen::Vector3d::Zero();                                  ///< m, world: corner 0
  Eigen::Vector3d edge1 = Eigen::Vector3d::Zero(), edge2 = Eigen::Vector3d::Zero();  ///< m, from corner 0
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();                                  ///< unit, or zero
  double doubled = 0.0;  ///< m²: twice the area; 0: no face to speak of
};

/// The anchor's face, `ahead` s from now. An anchor on one knot has none.
Face faceOf(const WorldState& state, const net::Anchor& a, double ahead = 0.0);
/// m, world; on the face, without the height.
Eigen::Vector3d footOf(const WorldState& state, const net::Anchor& a, double ahead = 0.0);
/// m, world, with it.
Eigen::Vector3d placeOf(const WorldState& state, const net::Anchor& a, double ahead = 0.0);
/// m/s: of the place.
Eigen::Vector3d velocityOf(const WorldState& state, const net::Anchor& a, const Face& face);
/// Adds a force (N) at the place to the held forces of the knots: their sum and torque are those of the
/// force.
void pushHeld(WorldState& state, const net::Anchor& a, const Face& face, const Eigen::Vector3d& force);
/// 1/kg: how the place answers to a force, at most.
double inverseMass(const WorldState& state, const net::Anchor& a, const Face& face);
/// Of each connection (1/s², 1/s): what a force at its ends does to it, and what all others that hold the
/// same knots do, levers included.
std::vector<solver::Rates> connectionRates(const Description& d, const WorldState& state);
/// Weights and height with which the anchor's face carries a place (m, world). False: there is no face.
bool carry(net::Anchor& a, const Face& face, const Eigen::Vector3d& place);

/// m: by how much a connection is stretched, from end 0 to end 1, each so many seconds from now.
Eigen::Vector3d stretchOf(const WorldState& state, const ConnectionState& s, const ConnectionConstants& k,
                          double ahead0 = 0.0, double ahead1 = 0.0);
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
