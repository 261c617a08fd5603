#pragma once

#include <array>

#include "stages.h"
#include "vest_tissue/interaction/sling.h"

/// The way that a sling takes on the tissue, for what lays it (sling.cpp) and what draws it (sling_hold.cpp).
namespace vest::scene {

inline constexpr double kPusher =
    0.0112;  ///< m from the tip frame to the pusher's end, where the loop leaves it
inline constexpr double kTurn = 6.283185307179586;
inline constexpr double kDrawn =
    0.5;  ///< m/s: a thread that is too short at once is drawn no faster; assumed
inline constexpr double kAround =
    kTurn * interaction::kSlingRadius;  ///< m: a thread around something is longer by that

/// m, world: where on the tissue a node lies.
Eigen::Vector3d placeOf(const ObjectState& s, const interaction::SlingTouch& t);
/// m, world: the end of the applicator's pusher, which holds the central knot.
Eigen::Vector3d pusherOf(const interaction::Proxy& proxy);
/// Length around the ring of knots of the tube in it, m. Per knot its gradient, no unit; null: unwanted.
double ringPath(const ObjectState& s, const interaction::Sling& sling, Eigen::Vector3d* gradient = nullptr);
/// Length of the way under the nodes that lie on the organ, on its surface, and over the applicator's knot
/// where it holds it: m. The thread outside is 2·pi·(its radius) longer. Per place of `loop` its gradient, no
/// unit.
double pathOf(const ObjectState& s, const interaction::Sling& sling, const LoopTissue& loop,
              const Eigen::Vector3d& knot, std::array<Eigen::Vector3d, LoopTissue::kMost>* gradient,
              Eigen::Vector3d* at_knot);

}  // namespace vest::scene
