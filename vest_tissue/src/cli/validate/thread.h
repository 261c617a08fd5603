#pragma once

#include "rods.h"

namespace vest::validate {

constexpr double kStep = 0.001;  ///< s

/// A straight polypropylene thread, 2-0, along the first axis.
/// @param length m @param damping 1/s, of its mass
inline suture::RodDescription thread(int segments, double length, double damping) {
  suture::RodDescription rod = suture::specimen::straight(static_cast<suture::Index>(segments));
  for (Eigen::Vector3d& x : rod.nodes) x *= length;
  rod.section = suture::solidSection(0.00016, 900, 3e9, 0.4);
  rod.section.strain_damping = 1e-4, rod.section.damping = damping;
  return rod;
}

}  // namespace vest::validate
