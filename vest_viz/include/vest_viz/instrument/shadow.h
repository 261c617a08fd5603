#pragma once

#include <Eigen/Core>

namespace vest::instrument {

/// Shadow of a long round shaft in the light of a small lamp, as three functions c = rows · (p, 1) that are
/// linear in the place p, so that a graphics pipeline interpolates them exactly between vertices:
///   c.y  distance from the lamp, across the shaft, over that of the shaft's axis: behind it above 1
///   c.x  distance from the plane of lamp and axis, over the shaft's radius: |c.x| < c.y lies in the shadow
///   c.z  way behind the end of the shaft, likewise: above 0 lies in the shadow
///
///        lamp ·--------( )--------------|  p       an edge is as wide as the lamp seen past it:
///             |<- 1 -->|                            2 · lamp / radius · (c.y - 1)
///             |<------------- c.y ----->|
struct CastShadow {
  Eigen::Matrix<float, 3, 4> rows;  ///< all zero: no shadow anywhere
};

/// m: radius of the lamp. The fibres of a 10 mm endoscope leave beside its lens as a crescent some 3 mm wide
/// (assumed).
constexpr double kLampRadius = 0.0015;

/// @param lamp, tip, far m, any frame: middle of the lamp, the shaft's end in the body, a point farther out
/// @param radius m, of the shaft. No shadow if the lamp is nearer to the axis than 1.5 radii, or the shaft
/// has no length: the lens looks past such a shaft at most.
CastShadow castShadow(const Eigen::Vector3d& lamp, const Eigen::Vector3d& tip, const Eigen::Vector3d& far,
                      double radius);

/// Share of the lamp that the shaft hides from p, 0 … 1. tissue.frag has the same words.
double shadowAt(const CastShadow& shadow, const Eigen::Vector3d& p, double radius);

}  // namespace vest::instrument
