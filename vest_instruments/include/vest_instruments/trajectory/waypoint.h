#pragma once

#include <vector>

#include <Eigen/Core>

namespace vest::trajectory {

/// A moment of a scripted motion of one instrument.
struct Waypoint {
  double t;             ///< s
  Eigen::Vector3d tip;  ///< m, world
  double roll, jaw;     ///< rad
  bool through;         ///< passed in motion, no rest
};

/// Waypoint at time t: rests before the first and after the last; between them the polynomial of fifth degree
/// with slopes through neighbours where it says `through` (Catmull and Rom 1974, uneven times; never more
/// than twice the gentler side, so that nothing overshoots). No acceleration at either end, which is minimum
/// jerk where it rests (Flash and Hogan 1985).  @param way not empty, times rise
Waypoint at(const std::vector<Waypoint>& way, double t);

}  // namespace vest::trajectory
