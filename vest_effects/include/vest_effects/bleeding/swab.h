#pragma once

#include <cmath>

/// Gauze that a grasper holds: it presses on what bleeds and soaks up what lies there.
namespace vest::bleeding {

/// m³ that a swab holds: gauze of 2 × 2 inches and 12 plies takes 3.25 ± 1.25 ml of saline (Hughes et al.
/// 2007, Dermatol. Online J. 13(4), 17).
constexpr double kSwabCapacity = 3.25e-6;
/// m: how far around its front's middle the wad covers and soaks: its radius (tools::toolGeometry) and 3 mm
/// by which tissue yields (assumed).
constexpr double kSwabReach = 0.010;
/// s: what is free of it fills by 1 − 1/e. Assumed: all but soaked in 10 s, in which absorbent cotton that
/// lies on water has to sink (European Pharmacopoeia 11, monograph 0036).
constexpr double kSwabTime = 3.3;

/// Pa: pressed so hard, gauze keeps half of what it holds at rest (assumed: it is what a hand wrings out).
constexpr double kSwabYields = 1.0e4;
/// m³ that a wad of `radius` m holds while it is pressed with `force` N over its cross-section.
inline double capacity(double force, double radius) {
  const double pressure = force > 0 ? force / (3.14159265358979 * radius * radius) : 0.0;
  return kSwabCapacity * kSwabYields / (kSwabYields + pressure);
}

/// Pa: contact modulus of gauze on soft tissue (assumed, as kSwabYields), and m: the radius that touches
/// when it only lies there (assumed).
constexpr double kSwabModulus = 1.0e4, kSwabTouch = 0.003;
/// m: radius of the patch that a wad of `radius` m presses on with `force` N: a³ = 3FR/(4E*) (Hertz 1882;
/// Johnson 1985, Contact Mechanics, section 4.2). At most kSwabReach: 1.9 N. No libm: recordings keep their
/// bits.
inline double pressedRadius(double force, double radius) {
  const double cube = 0.75 * (force > 0 ? force : 0.0) * radius / kSwabModulus;
  double a = kSwabReach;
  for (int i = 0; i < 12; ++i) a = a > kSwabTouch ? (2 * a + cube / (a * a)) / 3 : kSwabTouch;  // Newton
  return a < kSwabTouch ? kSwabTouch : a < kSwabReach ? a : kSwabReach;
}
/// Pressure at a distance from the patch's middle over that in the middle: sqrt(1 − d²/a²) (the same). What
/// gauze wipes goes with it (assumed). @param squared d², m² @param patch a, m
inline double pressedShare(double squared, double patch) {
  const double rest = patch > 0 ? 1 - squared / (patch * patch) : 0.0;
  return rest > 0 ? std::sqrt(rest) : 0.0;
}

/// What a swab holds.
struct Swab {
  double volume = 0, blood = 0;  ///< m³, and of it blood
  /// m³ that it can still take; < 0: that it has to give back. @param most m³, as capacity()
  double room(double most = kSwabCapacity) const { return most - volume; }
};

/// Share 0 … 1 of an opening that a wad of `radius` m shuts, pressed against it with `force` N while the
/// blood in it has `pressure` Pa above that around: the force spreads over the wad's cross-section.
inline double covered(double force, double pressure, double radius) {
  const double area = 3.14159265358979 * radius * radius;
  const double share = pressure > 0 ? force / (pressure * area) : 1.0;
  return share < 0 ? 0 : share < 1 ? share : 1;
}

}  // namespace vest::bleeding
