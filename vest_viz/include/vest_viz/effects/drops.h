#pragma once

#include <cstdint>

#include "vest_viz/effects/shapes.h"

/// Quads for fluid in the air, as ogre_media/drops.frag reads them: colours hold a radius (mm), a streak's
/// length over that radius, and how much the blood hides (hiding()).
namespace vest::effects {

/// What is drawn of a FluidState's particles. Arrays have `count` entries, or are null.
struct FluidParticles {
  const float* positions = nullptr;      ///< m, world, x y z
  const float* velocities = nullptr;     ///< m/s; null: all rest
  const std::uint8_t* blood = nullptr;   ///< 0 water … 255 blood; null: all blood
  const std::uint8_t* volume = nullptr;  ///< 255: a whole particle; null: all whole
  std::size_t count = 0;
  double radius = 0;  ///< m: half the edge of the cube of fluid that a whole particle is
};

/// How much of what lies behind it fluid hides: a little blood colours much water. @param blood 0 … 1
float hiding(double blood);

/// Drops of the particles' own volume, smeared along their motion across the picture while the shutter is
/// open: the shader fades each place by the share of that time in which the drop covers it. Particles that
/// follow one another in the air without others beside them are a stream: between two of them a cylinder of
/// the particle's volume, the last one the drop at its head. Single fast drops shed satellites. Slow ones lie
/// flatter.
/// @param eye m, camera in world  @param shutter s
/// @return particles left out because they are not finite
std::size_t addDrops(const FluidParticles& particles, const Eigen::Vector3d& eye, double shutter,
                     Quads* quads);
/// Air bubbles: x y z radius each, m.
void addBubbles(const float* bubbles, std::size_t count, const Eigen::Vector3d& eye, Quads* quads);

}  // namespace vest::effects
