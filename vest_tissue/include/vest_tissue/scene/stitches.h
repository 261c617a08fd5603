#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "vest_tissue/interaction/threads.h"
#include "vest_tissue/scene/world.h"
#include "vest_tissue/suture/knot_kind.h"

/// Figures of stitches, from a World's State alone. Nothing here allocates, and nothing in a step depends on
/// it.
namespace vest::scene {

/// Where a needle or thread goes into an object or comes out of it.
struct Mouth {
  std::uint16_t object = 0;
  bool exit = false;
  Eigen::Vector3d now = Eigen::Vector3d::Zero();   ///< m, world
  Eigen::Vector3d rest = Eigen::Vector3d::Zero();  ///< m, on the object's shape without load
};
/// A bite is a way through an object that has an entry and an exit, with needle or thread in it. A surface
/// has both in one place: one mouth, which counts as a bite.
struct Bites {
  std::size_t count = 0;  ///< of mouths
  std::array<Mouth, 2 * static_cast<std::size_t>(interaction::kMaxChannels)> mouths{};
};
void findBites(const World& world, Bites& out);

/// N: the greatest tension along any thread, without needles and what is cut.
double threadTension(const World& world);

/// The thread that is knotted most: of those with the greatest determinant the first.
struct Knot {
  suture::KnotKind kind;
  double tail = 0.0;                                ///< m: the shorter end beyond the knot; 0: no knot
  Eigen::Vector3d place = Eigen::Vector3d::Zero();  ///< m: in the middle between where both tails begin
};
Knot findKnot(const World& world, suture::KnotScratch& scratch);

}  // namespace vest::scene
