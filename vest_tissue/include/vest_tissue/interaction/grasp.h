#pragma once

#include <array>
#include <cstdint>

#include <Eigen/Core>

#include "vest_tissue/interaction/tool_state.h"
#include "vest_tissue/net/anchor.h"

namespace vest::interaction {

/// Grasping: the jaws that close on tissue pinch it,
///   pinch = kGreatestPinch·c²,  c = 1 - jaw/jaw_at_touch,
/// with the peak of 20.5 N that surgeons reach (Barrie 2013) at full closure; the quadratic form is assumed.
/// The jaws hold a pull of up to 5/3 of the pinch (5 N of pull need 3.0 N of pinch, Heijnsdijk); above it the
/// tissue slips.
inline constexpr double kGreatestPinch = kJawForceLimit;
inline constexpr double kHoldPerPinch = 5.0 / 3.0;
inline constexpr double kGraspClosure =
    0.15;  ///< closure at which tissue between the jaws counts as grasped; assumed
inline constexpr double kReleaseClosure = 0.05;  ///< and below which it is let go; assumed
inline constexpr double kJawHalfWidth = 0.0025;  ///< m: half the width of a jaw of a 5 mm instrument
inline constexpr int kMaxGraspAnchors = 24;

/// Tissue point held in the jaw frame: zero force at the moment of grasp.
struct GraspAnchor {
  std::uint16_t object = 0;
  std::uint32_t knot = 0;
  Eigen::Vector3d local = Eigen::Vector3d::Zero();  ///< m, in the tip frame: where the jaws hold it
  double stiffness = 0.0;                           ///< N/m
  double damping = 0.0;                             ///< N·s/m
};

/// State of one instrument's jaws.
struct Grasp {
  bool active = false;
  bool sliding = false;       ///< slipped in the last step
  double jaw_at_touch = 0.0;  ///< rad: opening at which the tissue filled the gap; 0: nothing between
  double pinch = 0.0;         ///< N
  int count = 0;
  std::array<GraspAnchor, kMaxGraspAnchors> anchors{};
  std::uint64_t id = 0;       ///< of the attachment
  std::uint32_t element = 0;  ///< contact triangle of the first object held
  std::array<double, 4> barycentric{};
};

bool hasJaws(tools::ToolKind kind);  ///< that hold tissue
/// Opening (rad) below which a point in the tip frame lies within both jaws; < 0: it lies outside their
/// reach.
double jawAngleAt(const tools::ToolGeometry& geometry, const Eigen::Vector3d& local, double thickness);
double pinchForce(double jaw, double jaw_at_touch);

}  // namespace vest::interaction
