#pragma once

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
