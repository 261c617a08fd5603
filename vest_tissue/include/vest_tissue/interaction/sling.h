#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "vest_tissue/net/anchor.h"

/// Ligation sling (models.md section 7): a pre-tied loop that hangs at the tip of its applicator, is laid
/// around a tubular organ and tightened until the organ is tied off.
///
/// Reduced model (docs/decisions/0222-…): the thread's stiffness is thousands of times the tissue's, so that
/// the loop is a length, l0, that the path around the organ's ring of knots cannot exceed. Its force is the
/// tension of that path at every knot, the gradient of a length: no net force, no net torque. Places and
/// impulse are solved for after each sub-step: stable at any step, independent of it.
namespace vest::interaction {

inline constexpr std::size_t kMaxSlings = 16;
inline constexpr int kMaxSlingKnots = 32;
inline constexpr int kSlingNodes = 32;         ///< of the loop as it is drawn
inline constexpr double kSlingLength = 0.120;  ///< m of the open loop: 38 mm across; assumed
inline constexpr double kSlingShortening = 1.2;  ///< sf, 1/s: l0 ← l0·exp(-sf·dt) while it is drawn; assumed
inline constexpr double kSlingRadius = 0.2e-3;  ///< m of the thread: USP 0 is 0.35 … 0.399 mm thick
inline constexpr double kSlingTension = 20.0;   ///< N that a hand draws with at most; assumed
inline constexpr double kSlingClosed = 0.2;     ///< of the cross-section before: the lumen is shut; assumed

struct Sling {
  std::uint64_t id = 0;
  bool alive = false;
  bool around = false;  ///< an organ lies in it
  bool tied = false;
  bool drawing = false;  ///< in this step
  std::int8_t instrument = -1;
  std::uint16_t object = 0;
  std::int32_t count = 0;  ///< knots of the ring that it lies around
  std::array<std::uint32_t, kMaxSlingKnots> knots{};
  double rest = kSlingLength;  ///< m: l0
  double tension = 0.0;        ///< N, smoothed over 5 ms
  double station = 0.0;        ///< m on the tube
  double area = 0.0;           ///< m²: cross-section before
  std::int32_t knot = 0;       ///< index of the ring's knot at which the central knot lies
  /// Loop as it hangs at the applicator: its knot, and the directions to its middle and across it.
  Eigen::Vector3d tip = Eigen::Vector3d::Zero();  ///< m, world
  Eigen::Vector3d ahead = Eigen::Vector3d::UnitZ(), across = Eigen::Vector3d::UnitX();
};

/// A cut doubled a knot of the organ: the sling holds what is on the side of its place (m, world).
void remapSling(Sling& sling, const net::KnotDoubling& cut, const Eigen::Vector3d& place);

/// Point of a loop of a length that hangs at the tip: turns 0 (the knot) … 1.
Eigen::Vector3d hangingLoop(const Sling& sling, double length, double turns);

}  // namespace vest::interaction
