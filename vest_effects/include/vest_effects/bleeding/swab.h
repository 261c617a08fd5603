#pragma once

/// Gauze that a grasper holds: it presses on what bleeds and soaks up what lies there.
namespace vest::bleeding {

/// m³ that a swab holds: gauze of 2 × 2 inches and 12 plies takes 3.25 ± 1.25 ml (Hughes et al. 2007,
/// Dermatol. Online J. 13(4), 17).
constexpr double kSwabCapacity = 3.25e-6;
/// m: radius of the wad (tools::ToolGeometry of the swab), and how far around its front's middle it covers
/// and soaks (assumed: tissue yields 3 mm).
constexpr double kSwabRadius = 0.007, kSwabReach = 0.010;
/// s: what is free of it fills by 1 − 1/e; gauze that lies on water is soaked within 10 s (EN 14079, sinking
/// time).
constexpr double kSwabTime = 3.3;

/// What a swab holds.
struct Swab {
  double volume = 0, blood = 0;  ///< m³, and of it blood
  double room() const { return volume < kSwabCapacity ? kSwabCapacity - volume : 0; }
};

/// Share 0 … 1 of an opening that the wad shuts, pressed against it with `force` N while the blood in it has
/// `pressure` Pa above that around: the force spreads over the wad's cross-section.
inline double covered(double force, double pressure) {
  const double area = 3.14159265358979 * kSwabRadius * kSwabRadius;
  const double share = pressure > 0 ? force / (pressure * area) : 1.0;
  return share < 0 ? 0 : share < 1 ? share : 1;
}

}  // namespace vest::bleeding
