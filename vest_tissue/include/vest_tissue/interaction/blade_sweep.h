#pragma once

#include <array>
#include <cstdint>

#include <Eigen/Core>

#include "vest_instruments/tools/tool_kind.h"
#include "vest_tissue/interaction/tool_state.h"

namespace vest::interaction {

/// What one cutting edge swept in one step, for nets, FEM objects and volumes alike. World, metres.
///
///      from[0] ─────────── from[1]      the edge at the start of the step
///         │        swept      │
///        to[0] ───────────  to[1]       and at its end; the next step's `from` is this step's `to`
///
/// The surface is that of the two triangles (from[0], from[1], to[1]) and (from[0], to[1], to[0]), so that
/// the sweeps of successive steps close without gap.
struct BladeSweep {
  bool active = false;          ///< it cuts: blades that close, a hook with its current on
  bool electric = false;        ///< the current cuts, not the edge
  std::uint8_t instrument = 0;  ///< tools::Instrument
  std::uint8_t blade = 0;       ///< 0 and 1: jaws of scissors; 0 and 1: wire and foot of a hook
  std::array<Eigen::Vector3d, 2> from{Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
  std::array<Eigen::Vector3d, 2> to{Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
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

/// Where a sweep crosses the segment p…q.
struct BladeCrossing {
  double place = 0;                                  ///< on p…q, 0 … 1 (a little outside within `slack`)
  double along = 0;                                  ///< on the blade's edge, 0 … 1
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();  ///< of the swept surface, length 1, from p's side to q's
};
/// Whether the sweep crosses p…q, the segment as it is at the end of the step.
/// @param shift m: way of the segment over the step (its mean); the sweep is taken relative to it
/// @param slack no unit: the segment counts as this much longer at both ends (0.02 lets neighbours overlap)
bool crosses(const BladeSweep& sweep, const Eigen::Vector3d& p, const Eigen::Vector3d& q,
             const Eigen::Vector3d& shift, double slack, BladeCrossing& crossing);

}  // namespace vest::interaction
