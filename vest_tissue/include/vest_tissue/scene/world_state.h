#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "vest_tissue/fem/tissue.h"
#include "vest_tissue/interaction/cut_state.h"
#include "vest_tissue/interaction/fasteners.h"
#include "vest_tissue/interaction/grasp.h"
#include "vest_tissue/interaction/heat.h"
#include "vest_tissue/interaction/suspension.h"
#include "vest_tissue/interaction/threads.h"
#include "vest_tissue/interaction/tool_state.h"
#include "vest_tissue/net/block.h"
#include "vest_tissue/net/elements.h"
#include "vest_tissue/net/link_kernel.h"
#include "vest_tissue/scene/fem_surface.h"
#include "vest_tissue/scene/held_load.h"
#include "vest_tissue/scene/world.h"
#include "vest_tissue/voxel/law.h"

namespace vest::scene {

/// Where a link of the topology is kept: in the block (elastic, viscous), or among the elements.
struct LinkPlace {
  LinkKind kind = LinkKind::Elastic;
  std::uint32_t index = 0;
};

/// Elastic or viscous link: its numbers, and its place in the packed table that the kernel reads.
struct NetLink {
  net::KernelLink values;
  bool by_law = false;                  ///< in law_links, else in linear_links
  std::uint32_t place = 0;              ///< index in that table
  float shrink = 1.0f, stiffen = 1.0f;  ///< no unit: what heat did to rest and axial (interaction/heat.h)
  float conductance = 0.0f;             ///< W/K, of heat; constant
};

/// Everything of one object that evolves. A copy is a snapshot.
struct ObjectState {
  net::Block block;                                     ///< knots
  std::vector<NetLink> links;                           ///< elastic and viscous
  net::LinkTable law_links, linear_links;               ///< the same, packed
  net::Elements elements;                               ///< slower elements
  Topology topology;                                    ///< links, skin, flags, revision
  std::vector<LinkPlace> places;                        ///< per link of the topology
  std::vector<std::array<std::uint32_t, 3>> triangles;  ///< contact triangles, knots
  std::vector<std::uint8_t> triangle_alive;
  std::vector<std::uint8_t> fixed;  ///< per knot
  std::vector<float> depth;    ///< per knot, m: how deep it may lie in rigid objects (<= 0), from the start
  int sub_steps = 1;           ///< per dt of the description, a multiple of `batches`
  int batches = 1;             ///< times a step that held forces are renewed: those at loading, or doubled
  float limit_strain = 0.0f;   ///< of the law now; lowered where the tangent would need too many sub-steps
  float bound_strain = 0.0f;   ///< greatest strain when `sub_steps` was last bounded
  double elastic_scale = 1.0;  ///< parameter edits: youngs_modulus over the scene's
  double damping_scale = 1.0;
  bool degraded = false;
  bool dropped = false;         ///< parts of it lost their support (support.cpp)
  HeldLoad load;                ///< from outside, on top of gravity
  interaction::HeatState heat;  ///< temperature and damage per knot
  interaction::CutState cut;
  FemSurface fem_surface;   ///< finite elements
  fem::TissueState tissue;  ///< finite elements; empty for nets. The block's X … VZ are a copy of it
  motility::MotilityState motility;  ///< phases of its waves
  /// m: sum over the steps of the furthest that any of its knots moved, and a metre for each change of
  /// topology; what was further away than that grew since cannot have come near.
  double way = 0.0;
  double way_bounded = -1.0;   ///< m: way when its greatest strain was last looked at; < 0: never
  double way_searched = -1.0;  ///< m: way and WorldState::way when its pairs were searched; < 0: never
};

/// Changes a link in the list and in its table. Real-time safe.
inline void setLink(ObjectState& s, std::size_t index, float axial, float rest, float damping) {
  NetLink& l = s.links[index];
  l.values.axial = axial, l.values.rest = rest, l.values.damping = damping;
  (l.by_law ? s.law_links : s.linear_links).setLink(l.place, rest, axial, damping);
}

/// A connection's state.
struct ConnectionState {
  net::Anchor end0, end1;
  bool alive = true;
  Eigen::Vector3d force = Eigen::Vector3d::Zero();  ///< N on end 0; kept where an end is elastostatic
};

/// Candidates for organ against organ, or against itself: a knot of one near a triangle of the other, or two
/// edges (ObjectConstants::edges).
struct OrganPair {
  std::uint16_t object = 0, other = 0;
  bool edges = false;
  std::int8_t side = 1;  ///< of the triangle on which the knot was first; for edges of their cross product
  std::uint32_t knot = 0;
  std::uint32_t triangle = 0;
  double clear = 0.0;  ///< m: before the sum of both objects' ways exceeds it they cannot touch
};

/// Side on which a tool's capsule touches a triangle, so that a deep or fast contact does not flip.
struct ContactSide {
  std::uint32_t triangle = 0;
  std::uint16_t object = 0;
  std::uint8_t tool = 0, capsule = 0;
  std::int8_t side = 1;
};

struct WorldState {
  std::uint64_t step = 0;
  double time = 0.0;  ///< s
  Eigen::Vector3d gravity = Eigen::Vector3d::Zero();
  std::uint32_t revision = 0;
  std::uint64_t next_attachment = 1;
  std::vector<ObjectState> objects;  ///< scene order
  std::vector<ConnectionState> connections;
  std::array<interaction::Proxy, tools::kInstrumentCount> proxies{};
  std::array<interaction::Grasp, tools::kInstrumentCount> grasps{};
  interaction::CuttingState cutting;
  /// Per object, a bit per instrument: its jaws' capsules do not push the object (held, or just let go), or
  /// its blades pass through it.
  std::vector<std::uint8_t> jaws_pass, blades_pass;
  std::vector<OrganPair> pairs;  ///< renewed when something came nearer
  double way = 0.0;              ///< m: sum over the steps of the furthest that any knot of any object moved
  std::uint32_t way_revision = 0;        ///< topology when ways were last measured
  std::uint32_t supported_revision = 0;  ///< topology when loose parts were last looked for
  std::vector<ContactSide> sides;        ///< sorted by tool, capsule, object, triangle
  interaction::Electrosurgery electrosurgery;
  interaction::Fasteners fasteners;  ///< clips, slings
  interaction::Suspensions suspensions;
  interaction::ThreadState threads;
  std::array<voxel::ToolState, tools::kInstrumentCount> in_image{};  ///< what tools feel of an image
  Energy energy;  ///< work and dissipated are kept, the others computed on demand
};

}  // namespace vest::scene
