#pragma once

#include <array>

#include <Eigen/Core>

#include "vest_tissue/interaction/sling.h"

/// The loop of a sling as a chain: nodes with mass, links that do not stretch, the bending that dilates it,
/// gravity, and planes that it cannot pass.
namespace vest::interaction {

/// What keeps a node on its side of a surface during one step: normal·x >= offset.
struct LoopPlane {
  bool active = false;
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();
  double offset = 0.0;    ///< m
  double friction = 0.0;  ///< Coulomb
  double pushed = 0.0;    ///< m: by which it held the node back in this step
};

/// One step of a loop.
struct LoopStep {
  double h = 0.001;                                           ///< s
  Eigen::Vector3d gravity = Eigen::Vector3d::Zero();          ///< m/s²
  std::array<Eigen::Vector3d, kSlingNodes> hanging_before{};  ///< m: hangingNode() at the last step's linkage
  std::array<Eigen::Vector3d, kSlingNodes> start{};  ///< m: nodes now; those on tissue have gone with it
  std::array<LoopPlane, kSlingNodes> planes{};
};

/// Where bending, inertia and gravity take the nodes, links and planes apart: m, world. Backward Euler, node
/// 0 at the tip:
///   (m/h² + c/h + k D^T D) (x - x_hanging) = m/h²·(x_free - x_hanging) + c/h·(x_0 - x_hanging,0) + m g,
/// D: second differences along the loop. The chain is bent elastically as far as it is as it hangs, k = EI/l³
/// of the open loop; what is drawn tighter has yielded, and keeps that moment (assumed).
void swing(const Sling& sling, const LoopStep& step, std::array<Eigen::Vector3d, kSlingNodes>& to);

/// Links are l0/kSlingNodes long (a Newton step on all of them at once is a tridiagonal system), planes are
/// not passed; where both cannot be, planes win: tissue that resists is drawn in by the length of the loop
/// (scene/stages.h: holdSlings()). Friction of planes holds nodes across the thread. Node 0 stays where it
/// is.
void link(const Sling& sling, LoopStep& step, std::array<Eigen::Vector3d, kSlingNodes>& nodes);

}  // namespace vest::interaction
