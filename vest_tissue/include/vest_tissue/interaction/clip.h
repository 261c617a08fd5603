#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "vest_tissue/net/anchor.h"

/// Clips: rigid staples that hold the tissue that the applier's jaws closed on (docs/decisions/0022-…).
///
/// A clip holds a group of knots in a shape, shut or on its way there. After each step the group's velocities
/// become those of the rigid body with the same momentum and angular momentum, and its places those of the
/// shape at the best fit with the same centre of mass (shape matching with the polar factor, Müller et al.
/// 2005, doi:10.1145/1073204.1073216): no net force and no net torque, whatever the step, and the clip goes
/// where the organ goes. The clip's own mass (titanium, tens of milligrams) is neglected.
namespace vest::interaction {

inline constexpr std::size_t kMaxClips = 64;
inline constexpr int kMaxClipKnots = 48;
inline constexpr double kClipGap = 0.4e-3;  ///< m between the outer surfaces of a crushed vessel; assumed
inline constexpr double kClipCatch =
    0.15;  ///< closure of the jaws on tissue at which the clip begins to form; assumed
inline constexpr double kClipShutJaw = 0.08;  ///< rad of the jaws at which it is shut for good; assumed
inline constexpr double kClipReload = 0.25;   ///< rad: the jaws open wider before the next clip; assumed
inline constexpr double kClipReach =
    0.35;  ///< of the distance of two rings: further from one, the other is held too

struct Clip {
  std::uint64_t id = 0;
  bool alive = false;
  bool shut = false;            ///< else the applier is still forming it
  std::int8_t instrument = -1;  ///< that set it
  std::uint16_t object = 0;
  bool joined = false;     ///< one of several parts of a clip on several objects, which share its id
  std::int32_t count = 0;  ///< knots in use
  std::int32_t ring = 0;   ///< the first so many are a ring around the lumen, in order; 0: no tube
  std::array<std::uint32_t, kMaxClipKnots> knots{};
  std::array<Eigen::Vector3d, kMaxClipKnots> open{},
      closed{};           ///< m about the centre of mass, in the clip's frame
  double progress = 0.0;  ///< 0 open … 1 closed
  double jaw = 0.0;       ///< rad of the applier when it began to form
  double station = 0.0;   ///< m on the tube, NaN without one
  double area = 0.0;      ///< m²: cross-section before, NaN without a tube
  double force = 0.0;     ///< N with which one leg presses, in the last step
  /// Frame: x from leg to leg, z along the legs to their ends, y along the tube; origin between the legs.
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();  ///< m, world: centre of mass of what it holds
  Eigen::Vector3d offset = Eigen::Vector3d::Zero();  ///< m, in its frame: of the clip from that centre
  /// m, in its frame, from its centre: two places along the legs that it shares with the first part of a clip
  /// that holds several objects.
  std::array<Eigen::Vector3d, 2> joint{Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
};

/// State of a clip or sling applier.
struct Applier {
  double jaw_at_touch = 0.0;  ///< rad; 0: nothing between the jaws
  bool loaded = true;
  bool drawn = false;  ///< of a sling applicator: its function was on
};

/// A cut doubled a knot: clips hold what is on their side.
void remapClips(std::vector<Clip>& clips, std::uint16_t object, const net::KnotDoubling& cut);

/// Closed shape of a ring of knots that is squeezed along x: two layers `gap` apart as long as half its
/// perimeter.
/// @param ring  in the clip's frame, in order around @param closed gets as many points
void flattenRing(const Eigen::Vector3d* ring, int count, double gap, Eigen::Vector3d* closed);

/// m²: area of a polygon in space, the length of its vector area.
double polygonArea(const Eigen::Vector3d* points, int count);

/// Angular velocity of a rigid group with this angular momentum, with no more rotational energy than given. A
/// flat group is thin: an error of its axis by a few thousandths would else turn momentum about the long axes
/// into a spin about the thin one, with many times the energy. As much inertia is added as that needs (a real
/// clip has some).
Eigen::Vector3d boundedTurn(const Eigen::Matrix3d& inertia, const Eigen::Vector3d& momentum, double energy);

/// Rotation nearest to sum of mass·place·shape^T, from a guess: a few Newton steps without trigonometry.
Eigen::Matrix3d nearestRotation(const Eigen::Matrix3d& moment, const Eigen::Matrix3d& guess);

}  // namespace vest::interaction
