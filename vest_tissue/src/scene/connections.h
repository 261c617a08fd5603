#pragma once

#include "connection_kernel.h"
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
/// Before a step's batches, after Body::soften(): ConnectionForce::softness of each connection.
void softenConnections(Context& c);
/// What connection n does to the knots of both ends in a batch of `h` s (ConnectionForce::knots); where
/// `renew` its forces are found anew, else as they were. Changes nothing else: any thread.
void pullTogether(Context& c, std::size_t n, double h, bool renew);
/// The same of connections whose forces are found anew, four at a time with the same bits: those of a knot
/// with a face, both with inertia, which nearly all are.
class FourConnections {
 public:
  explicit FourConnections(Context& c) : c_(c) {}
  bool takes(std::size_t n) const;
  void add(std::size_t n, double h);
  void finish() {
    if (count_ > 0) pull();
  }

 private:
  void pull();
  Context& c_;
  kernel::ConnectionLanes lanes_{};
  std::array<std::size_t, kernel::ConnectionLanes::kCount> number_{};
  std::array<double, kernel::ConnectionLanes::kCount> interval_{};
  std::size_t count_ = 0;
};
/// Adds it to the held forces of one end. Ends of different objects: any thread.
inline void holdEnd(Context& c, std::size_t n, std::size_t end) {
  const ConnectionState& s = c.state.connections[n];
  const net::Anchor& a = end == 0 ? s.end0 : s.end1;
  net::Block& b = c.state.objects[a.object].block;
  const auto& forces = c.scratch.connection_force[n].knots[end];
  for (std::size_t i = 0; i < 4; ++i) {
    if (a.weights[i] == 0.0 && !(end == 1 && i < 3)) continue;
    for (std::size_t axis = 0; axis < 3; ++axis)
      b.row(static_cast<net::Block::KnotRow>(net::Block::HX + axis))[a.knots[i]] += forces[i][axis];
  }
}
/// A connection that a blade or a pull severed: no more of it, a delta without entries, and an event.
void sever(Context& c, std::size_t n, double force, int instrument);

}  // namespace vest::scene
