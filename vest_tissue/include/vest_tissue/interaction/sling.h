#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "vest_tissue/net/anchor.h"

/// Ligation sling: a pre-tied loop with linkage to its applicator's tube, which dilates
/// by itself, is laid around an organ and tightened until the organ is tied off.
///
///            0          node 0: the central knot, in the pusher's end until it is tied
///          /   \         nodes 0 … 31, links i to i+1 of l0/32 each, closed
///        31     1       while untied: a chain in motion (interaction/sling_loop.h)
///        |       |      while it lies on tissue: its length is a limit of the tissue (docs/decisions/0022-…)
///        18 … 14
///
/// l0 <- l0·exp(-sf·dt) while it is drawn, and back likewise while it is let go with nothing in it: the same
/// for any step. Tension is the same all along the loop (a thread runs through its knot and along wet
/// tissue), so that the tissue feels the gradient of one length: what the applicator does not hold has no net
/// force and no net torque.
namespace vest::interaction {

inline constexpr std::size_t kMaxSlings = 16;
inline constexpr int kMaxSlingKnots = 32;  ///< of a ring of a tube that can be closed
inline constexpr int kSlingNodes = 32;
inline constexpr double kSlingLength = 0.120;    ///< m of the open loop: 38 mm across; assumed
inline constexpr double kSlingShortening = 1.2;  ///< sf, 1/s; assumed
inline constexpr double kSlingRadius = 0.2e-3;   ///< m of the thread: USP 0 is 0.35 … 0.399 mm thick
inline constexpr double kSlingTension = 20.0;    ///< N that a hand draws with at most; assumed
inline constexpr double kSlingClosed = 0.2;      ///< of the cross-section before: the lumen is shut; assumed
inline constexpr double kSlingDensity = 1300.0;  ///< kg/m³ of the thread; assumed
/// Pa, order of a monofil of polydioxanone; assumed. In print: 9.32 GPa, the highest initial modulus of nine
/// absorbable sutures 3-0 in tension, of a braid, rapid polyglactin 910 (Naleway et al. 2015, abstract,
/// doi:10.1002/jbm.b.33171).
inline constexpr double kSlingModulus = 1.5e9;

/// Where a node of the loop lies on tissue.
struct SlingTouch {
  bool on = false;
  std::int8_t side = 0;  ///< of the surface: 1 outside, -1 inside, 0 far from any
  std::uint16_t object = 0;
  std::array<std::uint32_t, 3> knots{};
  std::array<double, 3> weights{};                   ///< no unit, sum 1
  Eigen::Vector3d offset = Eigen::Vector3d::Zero();  ///< m, world: from that place to the node
};

struct Sling {
  std::uint64_t id = 0;
  bool alive = false;
  bool around = false;  ///< tissue lies in it
  bool tied = false;
  bool drawing = false;  ///< in this step
  std::int8_t instrument = -1;
  std::uint16_t object = 0;  ///< where around
  std::int32_t count = 0;  ///< knots of the ring of the tube that it closes; 0: around tissue that is no tube
  std::int32_t ring = -1;  ///< of the tube map; -1: none
  std::array<std::uint32_t, kMaxSlingKnots> knots{};  ///< of that ring
  double rest = kSlingLength;                         ///< m: l0
  double tension = 0.0;                               ///< N, smoothed over 5 ms
  double station = 0.0;                               ///< m on the tube, NaN without one
  double area = 0.0;  ///< m²: cross-section before; without a tube that of the loop when it was first taut
  std::array<Eigen::Vector3d, kSlingNodes> node{};      ///< m, world
  std::array<Eigen::Vector3d, kSlingNodes> velocity{};  ///< m/s
  std::array<SlingTouch, kSlingNodes> touch{};
  /// Linkage to the applicator: where the central knot sits, and the directions to the loop's middle and
  /// across it.
  Eigen::Vector3d tip = Eigen::Vector3d::Zero();  ///< m, world
  Eigen::Vector3d ahead = Eigen::Vector3d::UnitZ(), across = Eigen::Vector3d::UnitX();
};

/// A cut doubled a knot of the organ: a sling around a ring holds what is on the side of the ring's place (m,
/// world). One around other tissue goes with its triangles (scene/topology.h: followTriangle()).
void remapSling(Sling& sling, const net::KnotDoubling& cut, const Eigen::Vector3d& place);

/// Node of a loop of this length (m) that nothing but its linkage touches: a circle ahead of the tip, links
/// length/kSlingNodes long.
Eigen::Vector3d hangingNode(const Sling& sling, double length, int node);

}  // namespace vest::interaction
