#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "vest_instruments/tools/tool_kind.h"
#include "vest_tissue/suture/rod.h"

/// Threads of a World: rods that lie on tissue, are held in jaws, cut by scissors, and break.
namespace vest::interaction {

/// Jaws hold a thread as stiffly as their proxy bears at a step of 1 ms: a tenth of its mass over the step
/// squared, shared by the nodes that they hold.
inline constexpr double kThreadGrip = 5000.0;  ///< N/m
inline constexpr int kMaxGripNodes = 16;

/// What a node or segment of a thread touches.
enum class TouchKind : std::uint8_t {
  Tissue = 0,   ///< a node on the nearest triangle of an object that deforms
  Rigid = 1,    ///< a node in the distance grid of a rigid object
  Tool = 2,     ///< a segment on a capsule of an instrument
  JawFace = 3,  ///< a node between open jaws, on the inner face of one
};

/// A touch that outlives its step; sorted by `before()`.
struct ThreadTouch {
  std::uint32_t segment = 0;  ///< node, or segment by its first node
  std::uint16_t body = 0;     ///< object or instrument
  TouchKind kind = TouchKind::Tissue;
  std::uint8_t part = 0;                             ///< capsule, or jaw
  std::int8_t side = 1;                              ///< of a triangle; -1: behind it
  Eigen::Vector3d shear = Eigen::Vector3d::Zero();   ///< N, friction on the thread
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();  ///< of a capsule, towards the thread
};
inline bool before(const ThreadTouch& a, const ThreadTouch& b) {
  if (a.segment != b.segment) return a.segment < b.segment;
  if (a.kind != b.kind) return a.kind < b.kind;
  return a.body != b.body ? a.body < b.body : a.part < b.part;
}

/// A node held in the jaws' frame.
struct GripNode {
  std::uint32_t node = 0;
  Eigen::Vector3d local = Eigen::Vector3d::Zero();  ///< m, in the tip frame
};

/// Jaws of one instrument on threads.
struct ThreadGrip {
  bool active = false;
  bool sliding = false;       ///< slipped in the last step
  double jaw_at_touch = 0.0;  ///< rad: opening at which the thread filled the gap; 0: nothing between
  double pinch = 0.0;         ///< N
  int count = 0;
  std::array<GripNode, kMaxGripNodes> nodes{};
};

/// Everything of threads that evolves.
struct ThreadState {
  suture::State rod;
  std::vector<ThreadTouch> touches;
  std::array<ThreadGrip, tools::kInstrumentCount> grips{};
};

}  // namespace vest::interaction
