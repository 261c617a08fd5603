#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "vest_instruments/tools/tool_kind.h"
#include "vest_tissue/suture/knot_kind.h"
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
  std::uint32_t segment = 0;  ///< place (scene::ThreadPlace), or segment by its first place
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

/// Jaws of one instrument on a needle: a place of it and its direction are held in the tip's frame.
struct NeedleGrip {
  bool active = false;
  bool sliding = false;       ///< or turning, in the last step
  double jaw_at_touch = 0.0;  ///< rad: opening at which the needle filled the gap; 0: nothing between
  double pinch = 0.0;         ///< N
  std::uint32_t needle = 0;
  double station = 0.0;                             ///< m from the tip
  Eigen::Vector3d local = Eigen::Vector3d::Zero();  ///< m, in the tip frame: where the station is held
  Eigen::Quaterniond turn = Eigen::Quaterniond::Identity();  ///< of the needle's frame in the tip frame
};

inline constexpr int kMaxChannels = 32, kMaxChannelAnchors = 16;

/// A place of tissue between two of its contact triangles (solid tissue), or on one (a surface, a wall).
/// Triangles keep their numbers through cuts.
struct ChannelAnchor {
  std::array<std::uint32_t, 2> triangle{};
  std::array<double, 6> weight{};  ///< of their corners, sum 1
  double station = 0.0;            ///< m from the tip along needle and thread; < 0: nothing in it yet
  double along = 0.0;              ///< N, friction on what is in it, tangent from the tip back
  bool filled = false;
};

/// The way of a needle through one object, and of the thread behind it; without either a hole.
struct Channel {
  std::uint16_t object = 0;
  std::uint32_t needle = 0;
  bool filled = false;
  bool through = false;  ///< the last anchor is an exit
  double ahead = 0.0;    ///< m, solid tissue: cut beyond the last anchor
  int count = 0;
  std::array<ChannelAnchor, kMaxChannelAnchors> anchors{};  ///< from the entry on
};

/// A pusher on the loop that is tied beforehand: the standing part runs into its point and is drawn back in
/// it.
struct ThreadPusher {
  bool active = false;
  std::uint32_t strand = 0;
  std::uint32_t inside = 0;  ///< nodes of the strand, from its first one on, that are within the pusher
  double drawn = 0.0;        ///< m
};

/// The knot of a thread, as it was last looked for.
struct KnotWatch {
  suture::KnotKind kind, seen;  ///< what counts: seen twice running; and what was seen last
  bool drawn = false;           ///< told by an event: its strands pressed on each other
};

/// Everything of threads that evolves.
struct ThreadState {
  suture::State rod;
  std::vector<ThreadTouch> touches;
  std::array<ThreadGrip, tools::kInstrumentCount> grips{};
  std::array<NeedleGrip, tools::kInstrumentCount> needle_grips{};
  std::vector<Channel> channels;
  std::vector<KnotWatch> knots;  ///< per thread
  std::array<ThreadPusher, tools::kInstrumentCount> pushers{};
  /// Per thread: nodes from its first one on that lie in their packet, where nothing touches them.
  std::vector<std::uint32_t> packed;
};

}  // namespace vest::interaction
