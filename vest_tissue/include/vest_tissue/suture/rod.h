#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "vest_tissue/suture/block_chain.h"
#include "vest_tissue/suture/description.h"

/// Staggered Cosserat rods: a place x_i per node, a quaternion q_j per segment, R = R(q),
/// p = conj(q_j)·q_j+1, with the strains
///
///     Γ = Rᵀ(x_j+1 − x_j)/l − e3,      κ = (2/l)·Im p / Re p
///
/// and the energy Σ l/2·ΓᵀSΓ + Σ l/2·(κ−κ⁰)ᵀK(κ−κ⁰), S = diag(GA, GA, EA), K = diag(EI, EI, GJ). A frame that
/// is held at a node acts on the segments beside it through half an element. Steps are backward Euler, by
/// Newton's method with the exact Hessian on positions and rotations (Bergou et al. 2008 keep an angle
/// instead), as one block tridiagonal system a rod. A needle is the first piece of its rod: a rigid node with
/// mass and inertia, whose "segment" holds its end to the thread's first node.
namespace vest::suture {

constexpr Index kNone = 0xffffffffu;

/// A bending element between two frames; where a frame is held, one of them is that of the holder.
struct Joint {
  Index a = kNone, b = kNone;  ///< segments; kNone: the held frame `held`
  Index held = kNone;
  double length = 0.0;  ///< m
};

struct Strand {
  Index first = 0, nodes = 0, segments = 0;  ///< node and segment numbers follow each other
  bool closed = false;
  Section section;
  Index joints_begin = 0, joints_end = 0;
  Index needle = kNone;  ///< number in Model::needles: node and segment `first` are the needle
  Index threadFirst() const { return first + (needle != kNone ? 1 : 0); }
  Index next(Index node) const { return node + 1 < first + nodes ? node + 1 : first; }
};

struct NeedleModel {
  Index node = 0;                       ///< its centre of mass, and its frame: principal axes
  std::vector<Eigen::Vector3d> points;  ///< m, in its frame: tip to swage, evenly
  double radius = 0.0, length = 0.0;    ///< m
  double spacing = 0.0;                 ///< m, between points
  double hold = 0.0;                    ///< N/m, of the swage
  double swage = 0.0;                   ///< N
};

struct HeldModel {
  Index node = 0;
  Hold hold = Hold::Place;
  Eigen::Quaterniond frame = Eigen::Quaterniond::Identity();  ///< at the start, twist put in included
  std::vector<DriveRow> drive;                                ///< the start is its first row
};

/// A contact that was near in the last sub-step: it keeps its side.
struct LiveContact {
  Index a = kNone, b = kNone;                        ///< segments a < b, or b = kCylinder + number
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();  ///< from b to a
  Eigen::Vector3d force = Eigen::Vector3d::Zero();   ///< N, on a
};
constexpr Index kCylinder = 0x80000000u;

struct State {
  double time = 0.0;                      ///< s
  std::vector<Eigen::Vector3d> position;  ///< m, per node
  std::vector<Eigen::Vector3d> velocity;  ///< m/s
  std::vector<Eigen::Quaterniond> frame;  ///< per segment (by its first node); third axis along it
  std::vector<Eigen::Vector3d> spin;      ///< rad/s, in the frame
  /// 1/m, per joint. Twist beyond a small one is kept in `offset` and, with the other sign, in the third
  /// component here: p = conj(q_a·offset)·q_b stays near 1, and no number of turns is too many.
  std::vector<Eigen::Vector3d> natural_curvature;
  std::vector<Eigen::Quaterniond> offset;
  std::vector<std::uint8_t> severed;  ///< per segment: cut or broken, bears nothing and touches no thread
  std::vector<LiveContact> contacts;  ///< as many as `contact_count` are live
  Index contact_count = 0;
};

/// Immutable.
struct Model {
  /// @throws std::invalid_argument: rod, field, value, what is allowed
  explicit Model(const Description& description);

  Eigen::Vector3d gravity;
  std::vector<Strand> strands;
  std::vector<Cylinder> cylinders;  ///< axes of length 1
  std::vector<double> mass, drag;   ///< kg, N·s/m, per node
  std::vector<double> length;       ///< m, per segment
  std::vector<NeedleModel> needles;
  std::vector<Eigen::Vector3d>
      rest;  ///< no unit, per segment: from node to node over its length, in its frame
  std::vector<Eigen::Vector3d> stiffness;  ///< N, per segment: GA, GA, EA; of a needle that of its swage
  std::vector<Eigen::Vector3d> inertia;    ///< kg·m², per segment, in its frame
  std::vector<Eigen::Vector3d> force;      ///< N, weight and loads, per node
  std::vector<Joint> joints;
  std::vector<HeldModel> held;
  std::vector<Index> held_at;  ///< per node: number in `held`, or kNone
  State start;
};

/// The thread that a node, or a segment, belongs to.
inline const Strand& strandOf(const Model& model, Index node) {
  std::size_t k = 0;
  while (node >= model.strands[k].first + model.strands[k].nodes) ++k;
  return model.strands[k];
}

/// Force of the holder on the rod, and its moment about the node; world.
struct Reaction {
  Eigen::Vector3d force = Eigen::Vector3d::Zero();   ///< N
  Eigen::Vector3d moment = Eigen::Vector3d::Zero();  ///< N·m; zero where the frame is free
};

enum class StepStatus : std::uint8_t { Ok = 0, Degraded = 1, Fault = 2 };

/// Push: leans on what is outside, with friction. Hold: hangs from it. Slide: held across, and drawn along
/// against friction.
enum class Bond : std::uint8_t { Push = 0, Hold = 1, Slide = 2 };

/// What a rod leans on or hangs from: a spring between a place on a segment and a place outside, part of the
/// potential that a pass minimises. Its other end moves evenly over the step.
struct Support {
  Index segment = 0;
  double s = 0.0;                                 ///< on the segment, 0 … 1
  bool rigid = false;                             ///< on a needle, the segment's node: at `arm` instead
  Eigen::Vector3d arm = Eigen::Vector3d::Zero();  ///< m, in the needle's frame
  Bond bond = Bond::Push;
  Eigen::Vector3d from = Eigen::Vector3d::Zero(),     ///< m: the other end at the step's start
      to = Eigen::Vector3d::Zero();                   ///< and at its end
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  ///< out of what it leans on; Slide: along the way
  double reach = 0.0;                                 ///< m along the normal, where pushing begins
  double stiffness = 0.0;                             ///< N/m, along the normal and across
  double friction = 0.0;                              ///< Coulomb
  double grip = 0.0;                                  ///< N, Slide: friction without any load across
  double most = 0.0;  ///< N, Push: beyond it what is outside gives way; 0: never
  /// N, friction on the rod: at the start, then at the end. As long as it sticks it is a spring: no creep.
  Eigen::Vector3d shear = Eigen::Vector3d::Zero();
  Eigen::Vector3d force = Eigen::Vector3d::Zero();  ///< out: N on the rod, mean over the step
  double limit = 0.0;                               ///< N: of friction, in the pass
};

/// What turns a needle: a spring towards a frame that turns evenly over the step.
struct TurnSpring {
  Index segment = 0;
  Eigen::Quaterniond from = Eigen::Quaterniond::Identity(), to = Eigen::Quaterniond::Identity();
  double stiffness = 0.0;                            ///< N·m/rad
  Eigen::Vector3d moment = Eigen::Vector3d::Zero();  ///< out: N·m on the needle, world, at the step's end
};

struct ContactScratch;

/// Memory of a step; one per State that steps at the same time.
struct Scratch {
  explicit Scratch(const Model& model);
  ~Scratch();
  std::vector<Support> supports;                      ///< in and out; empty by itself
  std::vector<TurnSpring> turns;                      ///< in and out; empty by itself
  Eigen::Vector3d gravity = Eigen::Vector3d::Zero();  ///< m/s², beside the model's
  std::vector<Reaction> reactions;                    ///< out: per held node, at the step's end
  int passes = 0;                                     ///< out: Newton passes of the last step
  int parts = 0;                                      ///< out: sub-steps of the last step
  int sweeps = 0;                                     ///< out: sweeps over contacts of the last step
  double contact_residual = 0.0;                      ///< out: N, of the last sweep

  std::vector<BlockChain> chain;                             ///< per strand
  std::vector<Vector6> gradient, change;                     ///< per node: place and rotation of its segment
  std::vector<Eigen::Vector3d> strain_then, curvature_then;  ///< at the sub-step's start
  std::vector<Eigen::Vector3d> target;                       ///< per held node
  std::vector<Eigen::Quaterniond> held_frame;
  std::vector<Eigen::Vector3d> contact_force;  ///< N, per node
  double fraction_then = 0.0, fraction = 1.0;  ///< of the step, where the sub-step begins and ends
  State before, trial, backup;
  std::unique_ptr<ContactScratch> contacts;
};

/// Advances by dt in 1, 2, 4 or 8 sub-steps, as motion asks for. No allocation, no exception.
/// Fault: numbers were not finite, and the state is as before.
StepStatus step(const Model& model, State& state, Scratch& scratch, double dt);

/// Reactions of held nodes in a state at rest: scratch.reactions.
void findReactions(const Model& model, const State& state, Scratch& scratch);

struct StaticReport {
  bool converged = false;
  int iterations = 0;
  double residual = 0.0;  ///< N, greatest unbalanced force of a free node
  double load = 0.0;      ///< N, what it is measured against
};

/// Stable equilibrium with what is held at the end of its drive; a small push leads out of unstable ones.
/// Velocities become zero. Rods that touch, and rods beside cylinders, come to rest by damped steps instead,
/// to a thousandth of a segment; with friction the equilibrium is the one that this way leads to.
StaticReport solveStatic(const Model& model, State& state, Scratch& scratch);

/// N, of a segment: along it, tension positive; of a needle what pulls at its swage.
double tensionOf(const Model& model, const State& state, const Strand& strand, Index segment);

/// Parts of a thread that hang together, without its needle: f(first node, number of nodes).
template <class F>
void eachPart(const Strand& strand, const State& state, F f) {
  const Index end = strand.first + strand.nodes;
  for (Index i = strand.threadFirst(), first = i; i < end; ++i) {
    if (i + 1 < end && state.severed[i] == 0) continue;
    f(first, i + 1 - first);
    first = i + 1;
  }
}

/// Kinetic and elastic energy, and that of weight and dead loads, J.
double energy(const Model& model, const State& state);

/// XXH64 over the state's numbers, little-endian.
std::uint64_t stateHash(const State& state);

}  // namespace vest::suture
