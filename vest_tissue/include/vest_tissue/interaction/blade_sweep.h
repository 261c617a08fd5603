#pragma once

#include <array>
#include <cstdint>

#include <Eigen/Core>

#include "vest_instruments/tools/tool_kind.h"
#include "vest_tissue/interaction/tool_state.h"

namespace vest::interaction {

/// What one cutting edge swept in one step, for nets, FEM objects and volumes alike. World, metres.
struct BladeSweep {
  bool active = false;          ///< it cuts: blades that close, a hook with its current on
  bool electric = false;        ///< the current cuts, not the edge
  std::uint8_t instrument = 0;  ///< tools::Instrument
  std::uint8_t blade = 0;       ///< 0 and 1: jaws of scissors; 0 and 1: wire and foot of a hook
  /// Ends of the edge at the start of the step and at its end; the next step's `from` is this step's `to`.
  std::array<Eigen::Vector3d, 2> from{Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
  std::array<Eigen::Vector3d, 2> to{Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
};

/// m: a sweep looks this far beyond itself for what it may cut (longest way in a step).
inline constexpr double kSweepReach = 0.004;

/// A box along the axes, m; empty at first.
struct SweepBox {
  Eigen::Vector3d low = Eigen::Vector3d::Constant(1e30), high = Eigen::Vector3d::Constant(-1e30);
  void add(const Eigen::Vector3d& p) { low = low.cwiseMin(p), high = high.cwiseMax(p); }
  /// It touches the box of two points.
  bool holds(const Eigen::Vector3d& a, const Eigen::Vector3d& b) const {
    return (a.cwiseMin(b).array() <= high.array()).all() && (a.cwiseMax(b).array() >= low.array()).all();
  }
};

inline constexpr int kBladesPerTool = 2;
inline constexpr int kMaxSweeps = kBladesPerTool * tools::kInstrumentCount;

/// Blades pass each other by this half angle when they are closed, so that nothing stays whole between them
/// (rad; assumed: the overlap of sharp scissors, 0.3 mm at 17 mm).
inline constexpr double kBladeOverlap = 0.02;
/// Jaw speed (rad/s) above which closing scissors cut; assumed.
inline constexpr double kCuttingJawSpeed = 0.02;

/// Edges of a tool at a pose, and how many there are (0: this tool does not cut).
int bladeEdges(tools::ToolKind kind, const ToolPose& pose,
               std::array<std::array<Eigen::Vector3d, 2>, kBladesPerTool>& edges);

/// Sweeps of one tool over a step of dt seconds: `out` has room for kBladesPerTool. Returns how many; those
/// of idle blades are there with active = false. @param functions mask of tools::ToolFunction
int sweepsOf(const Proxy& before, const Proxy& after, std::uint32_t functions, double dt,
             std::uint8_t instrument, BladeSweep* out);

/// Segment p…q at the start of the step and at its end, in world, m.
struct MovingSegment {
  std::array<Eigen::Vector3d, 2> from, to;
};
/// Whether the edge and the segment pass through each other within the step, all four ends moving straight
/// (edges in continuous collision detection: Provot, Graphics Interface 1997). What passes is found in one
/// of two successive steps and never lost between them.
/// @param slack no unit: the segment counts as this much longer at both ends (0.02 lets neighbours overlap)
/// @param place where on p…q, 0 … 1 (a little outside within `slack`)
bool crosses(const BladeSweep& sweep, const MovingSegment& segment, double slack, double& place);

}  // namespace vest::interaction
