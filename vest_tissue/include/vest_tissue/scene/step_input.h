#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include <Eigen/Geometry>

#include "vest_instruments/tools/tool_kind.h"
#include "vest_tissue/scene/vessel_name.h"

namespace vest::scene {

/// What a step knows of one instrument. World frame, SI.
struct ToolInput {
  bool present = false;
  tools::ToolKind tool = tools::ToolKind::None;
  std::uint32_t functions = 0;                                      ///< bit mask of tools::ToolFunction
  Eigen::Vector3d position = Eigen::Vector3d::Zero();               ///< m, commanded tip
  Eigen::Quaterniond orientation = Eigen::Quaterniond::Identity();  ///< commanded tip
  Eigen::Vector3d pivot = Eigen::Vector3d::Zero();                  ///< m, trocar's pivot
  double jaw = 0.0;                                                 ///< rad, full opening angle
  Eigen::Vector3d sight = Eigen::Vector3d::UnitZ();  ///< endoscope: direction of view in the tip's frame
};

/// A change of a parameter, applied before the step.
struct ParameterEdit {
  std::string object;     ///< empty: the world
  std::string parameter;  ///< e.g. youngs_modulus, damping_scale, gravity_z
  double value = 0.0;
};

/// Momentum that a fluid passes to tissue.
struct ImpactInput {
  std::uint16_t object = 0;
  std::uint32_t triangle = 0;
  std::array<double, 3> weights{};
  Eigen::Vector3d momentum = Eigen::Vector3d::Zero();  ///< N·s
};

/// A steady force on a knot, the damping of its motion that comes with it, and how it follows the knot: its z
/// is force.z + stiffness·(max(0, L − z) − max(0, depth)), L the level that lies `depth` over the knot now.
struct KnotLoad {
  std::uint16_t object = 0;
  std::uint32_t knot = 0;
  std::array<float, 3> force{};  ///< N, world
  float damping = 0;             ///< N·s/m
  float stiffness = 0;           ///< N/m: < 0 where liquid presses from above
  float depth = 0;               ///< m, < 0: the knot is above the level
};

/// Feedback of the pulse: radius over reference radius along a vessel segment.
struct DilatationInput {
  static constexpr std::size_t kPlaces = 4;  ///< from the segment's begin to its end, evenly; linear between
  VesselName vessel_segment;
  std::array<float, kPlaces> dilatation{1, 1, 1, 1};
};

/// A change of the topology, applied before the step. As words on the wire: scene/request.h.
struct TopologyRequest {
  enum class Kind : std::uint8_t { RemoveLink = 0, SplitKnot = 1, RemoveClip = 2 };
  Kind kind = Kind::RemoveLink;
  std::uint16_t object = 0;
  std::uint32_t element = 0;  ///< link of the topology, knot, or id of a clip
  Eigen::Vector3d normal =
      Eigen::Vector3d::UnitZ();  ///< SplitKnot: of the plane through the knot, to the copy
};

/// Everything that a step consumes. Recording these and the State at the start is recording the session.
struct StepInput {
  std::uint64_t step = 0;
  double dt = 0.001;  ///< s
  std::uint32_t seed = 1;
  std::array<ToolInput, tools::kInstrumentCount> tools;
  std::vector<ParameterEdit> edits;
  std::vector<ImpactInput> impacts;
  /// Steady forces, as the weight of pools. Where `load_over` > 0 they take the place of all that were told
  /// before: what acts goes over to them linearly within that time (s), and then holds.
  std::vector<KnotLoad> loads;
  double load_over = 0.0;
  std::vector<DilatationInput> dilatations;
  /// m, 0 … 1: how far the highest place of the cavity's wall has sunk. All bodies meet the wall where it
  /// hangs (scene::CavityWalls).
  double sunk = 0.0;
  std::vector<TopologyRequest> requests;
};

}  // namespace vest::scene
