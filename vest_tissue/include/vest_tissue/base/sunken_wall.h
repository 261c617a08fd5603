#pragma once

#include <Eigen/Core>

namespace vest::contact {

constexpr double kProp = 0.03;        ///< m: there a wall hangs half as much as far from the lens (assumed)
constexpr double kLeastSunk = 0.001;  ///< m: less is neither drawn nor felt

/// A cavity's wall that sinks while gas is lost: straight down, by all of `sunk` at its highest place, by
/// nothing in its lower half, and smoothly between. It comes to lie on its lower half at most. The endoscope
/// in its trocar props it up: within some centimetres beside the lens the wall hangs less. Lengths in m,
/// places in the world.
struct SunkenWall {
  double sunk = 0;              ///< of its highest place, >= 0
  double middle = 0, high = 0;  ///< half the cavity's height, and its highest place
  bool propped = false;         ///< whether there is an endoscope
  Eigen::Vector3d lens = Eigen::Vector3d::Zero();

  bool sinks() const { return sunk > kLeastSunk && high > middle; }
  /// How far the wall hangs down that is at `place` where none is missing.
  double by(const Eigen::Vector3d& place) const;
  /// Where the wall would be, were it not sunken, that touches `place` now: `least` and `greatest` height of
  /// the places straight above that hang down to it. Between these it is folded.
  struct Above {
    double least = 0, greatest = 0;
  };
  Above above(const Eigen::Vector3d& place) const;
};

}  // namespace vest::contact
