#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include <Eigen/Core>

#include "vest_instruments/tools/tool_kind.h"
#include "vest_tissue/interaction/grasp.h"
#include "vest_tissue/net/anchor.h"

/// Suspension: tissue hangs on a thread from the abdominal wall, so that no hand has to hold it (T-lift,
/// hitch stitch). What jaws hold when their control is pressed stays where it is then, each knot on a spring
/// to its place; the jaws may open and go away. Pressed again with jaws that hold some of it, it is taken
/// off.
namespace vest::interaction {

/// As many as finite elements have points for, with a full grasp each (fem::kMostContactPoints); assumed.
inline constexpr std::size_t kMaxSuspensions = 4;
/// N: a greater pull tears the thread out. A stitch through human small bowel bears 4.62 ± 1.40 N (803 tests,
/// Gong et al. 2024, doi:10.1115/1.4063951); that it holds for every tissue is assumed.
inline constexpr double kSuspensionStrength = 4.62;
/// m: how far the thread is drawn upwards from the tissue; the wall hides what lies beyond it. Assumed.
inline constexpr double kSuspensionRise = 0.12;
inline constexpr double kSuspensionRadius = 0.2e-3;  ///< m of the thread that is drawn, as kSlingRadius

/// A knot that hangs.
struct HungKnot {
  std::uint16_t object = 0;
  std::uint32_t knot = 0;
  Eigen::Vector3d place = Eigen::Vector3d::Zero();  ///< m, world: where it was, and is pulled to
  double stiffness = 0.0;                           ///< N/m
  double damping = 0.0;                             ///< N·s/m
};

struct Suspension {
  std::uint64_t id = 0;  ///< of the attachment
  bool alive = false;
  std::int8_t instrument = -1;  ///< that hung it
  std::int32_t count = 0;       ///< knots in use
  std::array<HungKnot, kMaxGraspAnchors> knots{};
  Eigen::Vector3d force = Eigen::Vector3d::Zero();  ///< N, world: of the springs at the start of the step
};

struct Suspensions {
  std::array<Suspension, kMaxSuspensions> all{};
  std::array<bool, tools::kInstrumentCount> pressed{};  ///< the control, in the last step
};

/// m, world: the middle of the places that a suspension pulls to. Zero where it has none.
Eigen::Vector3d middleOf(const Suspension& suspension);

/// A cut doubled a knot of the object: what hangs stays on the side of the suspension's middle.
void remapSuspension(Suspension& suspension, std::uint16_t object, const net::KnotDoubling& cut);

}  // namespace vest::interaction
