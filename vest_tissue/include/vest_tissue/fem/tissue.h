#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "vest_tissue/fem/block_ldlt.h"
#include "vest_tissue/fem/compliance.h"
#include "vest_tissue/fem/model.h"

/// Finite elements among the objects of a World: touched, held, cut and pulled in real time. Frame: world.
namespace vest::fem {

class CutFactor;

inline constexpr std::size_t kMostTissueNodes = 20000;       ///< of an object (assumed)
inline constexpr std::size_t kMostSurfaceNodes = 2000;       ///< 288 MB of inverse (assumed)
inline constexpr std::size_t kMostElastostaticNodes = 1500;  ///< free ones: 162 MB of inverse (assumed)
/// Of a condensed object: tetrahedra and nodes (assumed), and free nodes that can be touched: 450 MB of
/// compliance (assumed).
inline constexpr std::size_t kMostCondensedElements = 150000, kMostCondensedNodes = 50000;
inline constexpr std::size_t kMostOuterNodes = 5000;
inline constexpr std::size_t kMostContactPoints = 96;  ///< contacts and held knots at a time (assumed)
inline constexpr std::size_t kMostThreadPoints = 32;   ///< of one thread, its knot among them
inline constexpr std::size_t kMostThreads = 3;         ///< drawn taut on an object at a time (assumed)
/// Points of one step.
inline constexpr std::size_t kMostTissuePoints = kMostContactPoints + kMostThreads * kMostThreadPoints;
inline constexpr int kTissueIterations = 24;    ///< of conjugate gradients in a step: bounded work (tuned)
inline constexpr int kMostGroupKnots = 48;      ///< that one rigid group holds (interaction::kMaxClipKnots)
inline constexpr std::size_t kMostGroups = 16;  ///< at a time (assumed)
/// Denatured collagen is up to a third shorter (Wright & Humphrey 2002, Annu. Rev. Biomed. Eng. 4:109) and
/// coagulated tissue several times stiffer; the factor is assumed. As links of nets (interaction/heat.h).
inline constexpr double kShrinkage = 0.3, kStiffening = 4.0;
/// m/s: fastest that an elastostatic object follows, and most that what touches a knot changes in a step
/// (assumed).
inline constexpr double kSnapSpeed = 10.0;

/// Immutable after prepareTissue().
struct TissueModel {
  std::unique_ptr<const Model> model;  ///< rest shape, masses, elements
  Motion motion = Motion::BackwardEuler;
  std::string cache_directory;  ///< where inverses are kept between runs; empty: nowhere
  std::vector<std::array<std::uint32_t, 4>> neighbours;  ///< element behind the face opposite to each corner
  std::vector<std::array<Index, 3>> surface;             ///< boundary faces, counter-clockwise from outside
  std::vector<Index> node_element;                       ///< per node: an element that has it
  double step = 0.0;                                     ///< s, that the factor is for
  BlockLdlt factor;                                      ///< of A0 = (1 + h a) M + h (h + b) K at rest
  std::vector<double> loose_inverse;                     ///< 1/kg per node: 3 over the trace of A0's block
  std::vector<std::int32_t> answer_number;  ///< per node: block row in `answer`; -1: held, or inner
  /// 3×3 blocks between surface nodes, m/N: displacement per force held for one step; h² A0^-1, or K^-1.
  Eigen::MatrixXd answer;
  double softest = 0.0;                         ///< m/N, elastostatic: greatest eigenvalue of K^-1
  std::array<Eigen::VectorXd, 3> unit_gravity;  ///< m per m/s², elastostatic: per unknown of `answer`
  /// m/N, elastostatic: displacement of a free node per force on it, at most.
  double softestAt(Index node) const {
    const std::int32_t row = answer_number[node];
    if (row < 0) return 0.0;
    const auto at = static_cast<std::size_t>(row);
    return condensed() ? compliance.block(at, at).trace() : answer.block<3, 3>(3 * row, 3 * row).trace();
  }
  Eigen::VectorXd under_loads;  ///< m, elastostatic: displacement by the loads of the scene

  // Of a condensed object: `model` has its outer nodes alone, and no elements.
  Compliance compliance;  ///< K^-1 between free outer nodes, by answer_number
  /// What gravity (N per m/s²) and the loads of the scene (N) are at outer nodes, those of inner nodes too.
  Eigen::Matrix<double, Eigen::Dynamic, 4> condensed_loads;
  double inner_mass = 0.0;                               ///< kg: of inner nodes, and
  Eigen::Vector3d inner_load = Eigen::Vector3d::Zero();  ///< N, the scene's loads on these
  std::shared_ptr<const Description> whole;              ///< with its inner nodes; null once prepared
  bool condensed() const { return motion == Motion::Condensed; }
};

/// Everything that evolves. Knots beyond the scene's nodes are copies that cuts made.
struct TissueState {
  std::vector<Eigen::Vector3d> x, v;         ///< m, m/s per knot
  std::vector<double> mass;                  ///< kg per knot
  std::vector<std::array<Index, 4>> corner;  ///< per element: knots
  std::vector<std::uint8_t> open;            ///< per element: bit f: face opposite to corner f is cut
  std::vector<Index> origin;                 ///< per knot: node of the scene
  std::vector<Index> knot_element;           ///< per knot: an element that has it
  double stiffness_scale = 1.0;              ///< parameter edit: Young's modulus over the scene's
  /// False: elastostatic and as it was built, so that the inverse of the whole object answers. Else each step
  /// solves with a factor.
  bool factored = true;
  std::vector<float> denatured;  ///< per element, 0 … 1, by heat; empty: none
  std::uint32_t revision = 0;    ///< of corner; 0: as the scene says
};

/// A place that is pushed or held during one step: kind 0 unilateral contact, kind 1 bilateral hold, kind 2
/// part of a thread. `between`: a contact of two places of the same tissue. The last three knots are those of
/// the second place, with weights below zero. Then target and target_velocity are zero, and the force on the
/// second place is the opposite one.
struct TissuePoint {
  std::array<Index, 6> knots{};
  std::array<double, 6> weights{};
  bool between = false;
  int used() const { return between ? 6 : 3; }  ///< knots
  std::uint8_t kind = 0;
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();  ///< contact: from the tissue to the tool
  Eigen::Vector3d target = Eigen::Vector3d::Zero();  ///< m: tool's axis, or where it is held, at the end
  Eigen::Vector3d target_velocity = Eigen::Vector3d::Zero();  ///< m/s
  double reach = 0.0;                                         ///< m, contact: axis to touching surface
  double stiffness = 0.0;                                     ///< N/m
  double damping = 0.0;                                       ///< N·s/m, hold
  double friction = 0.0;                                      ///< Coulomb, contact
  double most_stiffness = 0.0;  ///< N/m: above it the tool's own coupling would not bear the contact
  std::uint8_t tool = 0;
  std::int32_t with = -1;                           ///< hold: the next one on the same knot; -1: none
  bool led = false;                                 ///< hold: one before it is on the same knot
  std::uint32_t source = 0;                         ///< the caller's
  Eigen::Vector3d force = Eigen::Vector3d::Zero();  ///< N, result: on the tissue
  double compliance = 0.0;  ///< m/N, result: of the tissue alone along the normal (hold: mean)
  double slip_power = 0.0;  ///< W, result: turned into heat by friction and damping
};

/// A closed thread over places of the tissue, drawn taut: the way over them in their order, and over the
/// applicator's knot where it is held, is not longer than it may be. It runs freely over them: one tension.
struct TissueThread {
  std::uint32_t source = 0;  ///< the caller's
  std::uint32_t first = 0;   ///< of its points, kind 2, in a row
  int count = 0;
  bool held = false;  ///< the knot comes after the last point
  Eigen::Vector3d knot = Eigen::Vector3d::Zero(), knot_end = Eigen::Vector3d::Zero();  ///< m: start and end
  double length = 0.0;   ///< m, at the end of the step
  double fastest = 0.0;  ///< m/s: no shortening is faster
  double most = 0.0;     ///< N
  double tension = 0.0;  ///< N: of the step before; result: of this one
};

/// Knots that move as one rigid body during a step: what a clip holds. Places at its end: goal, turned and
/// shifted by any small rigid motion.
struct TissueGroup {
  int count = 0;
  std::uint32_t source = 0;                            ///< the caller's
  std::array<std::uint8_t, kMostGroupKnots> member{};  ///< the caller's
  std::array<Index, kMostGroupKnots> knots{};
  std::array<Eigen::Vector3d, kMostGroupKnots> goal{};  ///< m
  std::array<Eigen::Vector3d, kMostGroupKnots> arm{};   ///< m, of the goal from their mean: prepareGroup()
  Eigen::Matrix3d inverse = Eigen::Matrix3d::Zero();    ///< 1/m², of sum |arm|² I - arm arm^T
  /// N·m: how the tissue's forces resist a turn of the arms that they pull at (freeTissueStep()).
  Eigen::Matrix3d turning = Eigen::Matrix3d::Zero();
  std::array<Eigen::Vector3d, kMostGroupKnots> impulse{};  ///< N·s, result: of the clip on each knot
};
/// Arms, and the inverse of their inertia. Its knots must be free, and in no other group.
void prepareGroup(TissueGroup& group);

/// Sized once.
struct TissueScratch {
  TissueScratch() = default;
  TissueScratch(const TissueModel& model, std::size_t knot_capacity);
  void forget();     ///< the next state is not what the last one led to
  BlockLdlt factor;  ///< a copy: solving needs room of its own
  std::vector<Eigen::Matrix3d> rotation;
  std::vector<Eigen::Vector3d> force, v_next, r, z, p, q, turned;  ///< per knot
  std::vector<Eigen::Vector3d> sum;                                ///< per node
  std::vector<std::uint32_t> count;                                ///< per node
  Eigen::VectorXd work, u;
  std::vector<Compliance::Load> loads;   ///< on a condensed object
  std::vector<Eigen::Matrix3d> answers;  ///< between points: answerPoints()
  std::vector<TissuePoint> points;
  std::vector<TissueThread> threads;
  std::vector<Eigen::Matrix3d> thread_answers;  ///< m/N: of links to the forces of links
  std::vector<double> thread_matrix;
  std::vector<TissueGroup> groups;
  std::vector<Eigen::Vector3d> group_residual;
  std::shared_ptr<CutFactor> cut;  ///< of the cut object, in the factor's place (cut_factor.h)
  /// s: time constant with which parts in equilibrium come to it; 0: at once. As a Kelvin-Voigt body without
  /// mass. A thread that is drawn finds its places anew in each step, and these must not run away from it.
  double delay = 0.0;
  /// m/s: a solve ends where what is left would change velocities by less than this, as the root of the mean
  /// square weighted by masses; the next step takes it up. 0: runs on to the relative tolerance.
  double quiet = 0.0;
  int most_iterations = kTissueIterations;
  double residual = 0.0;  ///< of the last solve, relative
  int iterations = 0;     ///< of the last solve; 0: the factor was exact
};

/// Displacement that a force on a knot causes at another within the step, between all points: into
/// scratch.answers, m/N. For a step of h seconds of the object as it is now, cut or not; turned with the
/// elements of a corotational object. They shape the forces of contacts, not the motion.
void answerPoints(const TissueModel& tissue, const TissueState& state, double h, TissueScratch& scratch);

/// Checks, and everything but the factors. @throws std::invalid_argument naming the object
std::shared_ptr<TissueModel> makeTissue(const Description& description, Motion motion,
                                        const std::string& cache_directory);
/// Factors for steps of h seconds. `progress`: told how far a condensed object is, 0 … 1; may be empty.
/// @throws std::invalid_argument naming the object
void prepareTissue(TissueModel& tissue, double h, const std::function<void(double)>& progress = {});
TissueState tissueAtRest(const TissueModel& tissue, const std::vector<Eigen::Vector3d>& position);

/// One step of h seconds in three parts, all real-time safe.
/// 1. Free motion under `held` forces (N per knot, three rows; gravity is among them but for elastostatic
///    objects, which know it from `gravity`, m/s²). Held parts of elastostatic objects go to their
///    equilibrium under these forces at once, cut or not. False: not finite.
bool freeTissueStep(const TissueModel& tissue, const TissueState& state, double h,
                    const std::array<const float*, 3>& held, const Eigen::Vector3d& gravity,
                    TissueScratch& scratch);
/// 2. Forces of scratch.points, implicit: with the compliances between all points, block Gauss-Seidel over
///    scalar complementarity and Coulomb's disc (projected Gauss-Seidel: Jourdan, Alart, Jean 1998,
///    doi 10.1016/S0045-7825(97)00162-3). Stable for any stiffness of tool or tissue.
void solveTissuePoints(const TissueModel& tissue, const TissueState& state, double h, TissueScratch& scratch);
/// Part of it, before the contacts: tension of a thread and forces of its points. `start`, `end`: m, per
/// point, at the start of the step and at its end; the thread's forces change the end. The tension turns with
/// the links within the step: stable however short they are.
void solveThread(TissueScratch& scratch, TissueThread& thread, double h, const Eigen::Vector3d* start,
                 Eigen::Vector3d* end);
/// 3. Moves the state. False: not finite, nothing has moved.
bool endTissueStep(const TissueModel& tissue, TissueState& state, double h, TissueScratch& scratch);

/// -gradient of the strain energy per knot, N, into scratch.force.
void tissueForces(const TissueModel& tissue, const TissueState& state, TissueScratch& scratch);
double tissueEnergy(const TissueModel& tissue, const TissueState& state);  ///< J, strain energy
/// Least volume of the elements that have a marked knot, over that at rest: no unit, 1 without any.
double leastVolume(const TissueModel& tissue, const TissueState& state,
                   const std::vector<std::uint16_t>& marked);
/// Greatest principal strain (absolute) of the elements at each knot, no unit.
void tissueStrain(const TissueModel& tissue, const TissueState& state, float* per_knot);
/// Greatest equivalent stress (von Mises) of the elements at each knot, Pa; Hooke's law of the element's
/// strain, rotations taken out where the description says `corotational`.
void tissueStress(const TissueModel& tissue, const TissueState& state, float* per_knot);
/// Polar rotation of F, the fast way for shapes that are not degenerate (Higham 1986, doi 10.1137/0907079);
/// nearestRotation() for the others.
Eigen::Matrix3d polarRotation(const Eigen::Matrix3d& F);

}  // namespace vest::fem
