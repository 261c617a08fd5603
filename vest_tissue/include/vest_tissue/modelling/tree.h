#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "vest_tissue/modelling/spline.h"
#include "vest_tissue/scene/description.h"

/// Trees of vessels and ducts, by rules (Lindenmayer, J. Theor. Biol. 18, 1968, 280-315, read as branches) or
/// by what they supply (Schreiner and Buxbaum, IEEE Trans. Biomed. Eng. 40(5), 1993, 482-491; Karch et al.,
/// Comput. Biol. Med. 29(1), 1999, 19-38).
namespace vest::modelling {

/// An ellipsoid with axes along the world's.
struct Region {
  Vector3 centre = Vector3::Zero(), half_axes = Vector3::Zero();  ///< m
};

/// What a tree is grown from. Signs of a production: F a branch, or the same branch longer where no other
/// leaves between; [ ] what leaves at its end; / turns the plane of the next branching; letters are replaced.
/// A tree with a region has no word: its `terminals` lie spread over the region.
struct TreeSpec {
  Vector3 root = Vector3::Zero(), direction{0, 0, 1};
  Vector3 plane{1, 0, 0};  ///< the first branching lies in direction and this
  double radius = 0.001;   ///< m, of the first branch
  std::string axiom;
  std::map<char, std::string> productions;
  std::uint32_t steps = 1, seed = 1;
  double length = 12.0;  ///< no unit: of a branch over its radius (assumed; Nakamura: in proportion to it)
  double turn = 1.5707963267948966;  ///< rad, of a /
  double scatter = 0.0;              ///< no unit: share by which lengths and angles vary
  double least = 0.0003;             ///< m: thinner branches are not drawn
  std::uint32_t around = 6;
  std::string
      supply;         ///< artery of the patient at whose end it begins; empty: a duct, which carries no blood
  double flow = 0.0;  ///< m³/s; 0: that of kShear
  std::optional<Region> region;
  std::uint32_t terminals = 0;
};

struct TreeBranch {
  int parent = -1;
  Vector3 from, to, axis;  ///< m; axis: unit, the branch leaves its parent's direction by a turn about it
  double radius = 0.0;     ///< m
  std::uint32_t ends = 1;  ///< of the tree behind it; flow is shared in proportion
  bool drawn = true;
};

/// r0^x = r1^x + r2^x by the radius before a branching, m: Nakamura and Awa, Physiol. Rep. 2(2), 2014,
/// e00236, doi:10.1002/phy2.236: 2.33 above 1 mm, 2.7 above 0.1 mm, 3 below.
double radiusExponent(double radius);

/// Of the first of two branches with the direction before, rad: least work, Murray, J. Gen. Physiol. 9, 1926,
/// 835-841: cos = (r0^4 + r1^4 - r2^4)/(2 r0² r1²).
double branchAngle(double before, double this_one, double other);

/// m, of a branch with `ends` of those that `before` supplies, where two leave: flow is shared by ends.
double radiusBehind(const TreeBranch& before, std::uint32_t ends);

/// Parents before their branches. A branch thinner than `least` ends the tree there; it is kept, undrawn,
/// where it leaves beside one that is drawn. @throws std::invalid_argument saying what is wrong
std::vector<TreeBranch> growTree(const TreeSpec& spec);

/// All branches of the tree that supplies `spec.region`, thin ones as well. One end after the other joins the
/// branch where the tree then has the least volume, and keeps clear of other branches. Last, each branching
/// moves to where it costs least, so that angles are those of branchAngle. Ends carry the same flow.
/// @throws std::invalid_argument where not all ends find a place
std::vector<TreeBranch> fillRegion(const TreeSpec& spec);

/// m: wall of an artery, Boileau et al., Int. J. Numer. Meth. Biomed. Eng. 31(10), 2015, e02732, as in the
/// network of the shipped patient.
double wallOf(double radius);
/// Pa: shear on an artery's wall by its mean flow (1 to 7 Pa: Malek, Alper, Izumo, JAMA 282, 1999, 2035).
inline constexpr double kShear = 1.5;
/// m³/s: the flow that shears a wall of this radius by kShear, Poiseuille's profile.
double flowOf(double radius);

/// The tree as a case that vest_pulse runs (vest_effects/README.md). `name` begins its segments' names.
scene::VesselTree vesselTree(const std::string& name, const TreeSpec& spec,
                             const std::vector<TreeBranch>& branches, double youngs_modulus);

/// NAME_1, NAME_2, …
std::string branchName(const std::string& tree, std::size_t branch);

}  // namespace vest::modelling
