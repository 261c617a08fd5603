#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Geometry>

#include "vest_tissue/interaction/heat.h"
#include "vest_tissue/interaction/sling.h"
#include "vest_tissue/net/anchor.h"
#include "vest_tissue/scene/description.h"
#include "vest_tissue/scene/step_input.h"

namespace vest::solver {
class Pool;
}
namespace vest::suture {
struct Reaction;
}

namespace vest::scene {

/// Outcome of a step. Real-time code looks at this; nothing throws inside a step.
enum class Status : std::uint8_t {
  Ok = 0,
  Degraded = 1,  ///< an object runs with bounded accuracy (announced in the report)
  Fault = 2,     ///< last good state kept, zero force
};

/// Kinds of events; values are those of vest_msgs/TissueEvent.
enum class EventKind : std::uint8_t {
  Grasped = 0,
  Released,
  Slipped,
  Cut,
  Clipped,
  Unclipped,
  Coagulated,
  Punctured,
  Ligated,
  Torn,
  KnotTied,
  Perforated,
  Separated,
  Fault,
  Exited,
  TornOut,
  Suspended,
  Unsuspended,
};

struct Event {
  EventKind kind = EventKind::Grasped;
  std::uint64_t step = 0;
  std::int8_t instrument = -1;  ///< tools::Instrument, -1: nobody
  std::uint16_t object = 0;
  std::uint32_t element = 0;  ///< contact triangle of the object
  std::array<double, 4> barycentric{};
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< m, world
  double station = 0;  ///< m on the tube's centre line, NaN where there is none
  double area = 0;     ///< m², NaN where there is none
  double force = 0;    ///< N
  double energy = 0;   ///< J
};

/// Unilateral plane: normal·x >= offset is free space (no force beyond it). World, metres.
struct ContactPlane {
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();
  double offset = 0;
};

/// F(x, v) = wrench - K (x - x0) - B (v - v0), the force of the tissue on the instrument at the proxy's tip,
/// world.
struct ContactModel {
  bool in_contact = false;
  bool grasping = false;
  std::uint64_t step = 0;
  Eigen::Isometry3d proxy = Eigen::Isometry3d::Identity();
  Eigen::Matrix<double, 6, 1> velocity = Eigen::Matrix<double, 6, 1>::Zero();  ///< m/s, rad/s
  Eigen::Matrix<double, 6, 1> wrench = Eigen::Matrix<double, 6, 1>::Zero();    ///< N, N·m
  Eigen::Matrix<double, 6, 6> stiffness = Eigen::Matrix<double, 6, 6>::Zero();
  Eigen::Matrix<double, 6, 6> damping = Eigen::Matrix<double, 6, 6>::Zero();
  std::array<ContactPlane, 4> planes{};
  int plane_count = 0;
  double radius = 0.005;                            ///< m
  double pinch_force = 0;                           ///< N
  double jaw_torque = 0;                            ///< N·m
  Eigen::Vector3d image = Eigen::Vector3d::Zero();  ///< N: part of the wrench that a patient's image takes
  bool image_alone = false;                         ///< nothing but the image is touched
};

/// Energies since the start, J. kinetic + elastic + potential + dissipated = start + work within rounding.
struct Energy {
  double kinetic = 0, elastic = 0, potential = 0, dissipated = 0, work = 0;
};

/// What a World knows per knot; values are those of vest_msgs/TissueField.
enum class Field : std::uint8_t {
  Strain = 0,       ///< no unit: largest absolute strain of the links
  Temperature = 1,  ///< K, of the touched surface
  Damage = 2,       ///< no unit, 0 … 1: denatured or crushed, at the surface
  Perfusion = 3,    ///< no unit, 0 … 1: share of the healthy perfusion
  Stress = 5,       ///< Pa: greatest equivalent stress (von Mises; along a link its absolute value)
  Char = 6,         ///< no unit, 0 … 1
};

/// Heat that a coagulating tool brought into tissue in one step; Event::energy tells the sums, once a second.
struct ToolHeat {
  double energy = 0;                                   ///< J
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< m, where > 0
};

/// What a step tells. Sized once; bounded.
struct StepReport {
  Status status = Status::Ok;
  std::string_view fault_object;  ///< name of the object, empty without fault
  std::vector<Event> events;      ///< events of this step (capacity reserved)
  std::array<ContactModel, tools::kInstrumentCount> contacts;
  std::array<ToolHeat, tools::kInstrumentCount> heat;
  std::array<double, 8> stage_seconds{};  ///< CPU time per stage, only if timing was asked for
};

/// Links, bindings and flags of one object as they are now; element indices never shift, dead ones stay and
/// are marked.
struct Topology {
  std::uint32_t revision = 0;
  std::vector<Link> links;
  std::vector<std::uint8_t> link_alive;
  Skin skin;
  std::vector<std::uint8_t> triangle_alive;
  std::vector<std::uint32_t>
      doubled_knots;  ///< P of each copy P'; copies are numbered behind the scene's knots
};

/// One change between two revisions of an object, in the order of vest_msgs/TissueTopologyDelta. One without
/// any entry tells that something outside the object's lists changed: a connection tore.
struct TopologyDelta {
  std::uint16_t object = 0;
  std::uint32_t from_revision = 0;  ///< of the world
  std::uint32_t revision = 0;       ///< of the world
  std::uint32_t object_revision = 0;
  std::vector<std::uint32_t> removed_links;
  std::vector<Link> added_links;
  std::vector<std::uint32_t> doubled_knots;
  std::vector<std::uint32_t> removed_triangles;
  std::vector<std::array<std::uint32_t, 3>> added_triangles;
  std::vector<std::uint16_t> added_triangle_layer;
  Skin added_skin;  ///< new vertices: binding and texture coordinates
  std::vector<std::uint32_t> rebound_vertices;
  Skin rebound_skin;  ///< their new binding
};

/// A clip, a grasp … that viewers draw.
struct Attachment {
  std::uint64_t id = 0;
  std::uint8_t kind = 0;  ///< vest_msgs/TissueAttachment
  net::Anchor anchor;
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  double station = 0;
  double closure = 0;
  std::int8_t instrument = -1;
};

/// A ligation sling that viewers draw (interaction/sling.h).
struct SlingView {
  std::uint64_t id = 0;
  bool around = false, tied = false;
  std::uint16_t object = 0;                                         ///< where `around`
  double rest_length = 0.0;                                         ///< m
  double tension = 0.0;                                             ///< N
  Eigen::Vector3d knot = Eigen::Vector3d::Zero();                   ///< m, world: the central knot
  std::array<Eigen::Vector3d, interaction::kSlingNodes> positions;  ///< m, world: the loop, closed
};

/// Tissue that hangs on a thread, for viewers (interaction/suspension.h).
struct SuspensionView {
  std::uint64_t id = 0;
  Eigen::Vector3d tissue = Eigen::Vector3d::Zero();  ///< m, world: middle of what hangs
  Eigen::Vector3d wall = Eigen::Vector3d::Zero();    ///< m, world: the thread's other end
  Eigen::Vector3d force = Eigen::Vector3d::Zero();   ///< N, world, on the tissue
};

/// A thread, or what scissors left of one, that viewers draw.
struct ThreadView {
  std::uint16_t suture = 0;                ///< of the scene's
  std::uint32_t first = 0;                 ///< node of the suture that it begins with
  std::vector<Eigen::Vector3d> positions;  ///< m, world
  std::vector<double> tension;             ///< N, per segment
};

/// A needle that viewers draw.
struct NeedleView {
  std::uint16_t suture = 0;                ///< of the scene's
  std::int8_t instrument = -1;             ///< that holds it; -1: none
  bool threaded = true;                    ///< the thread still holds in its end
  double radius = 0.0;                     ///< m, of the wire
  std::vector<Eigen::Vector3d> positions;  ///< m, world: tip to swage
};

struct WorldModel;    ///< immutable once built (world_model.h)
struct WorldState;    ///< everything that evolves; a copy is a snapshot (world_state.h)
struct WorldScratch;  ///< sized once, no meaning between steps (world_scratch.h)

inline constexpr std::uint32_t kNotAdopted = 0xffffffffu;  ///< World::adopt
inline constexpr std::size_t kDeltaHistory = 256;  ///< deltas that a World keeps for late readers (assumed)

/// First bytes of a snapshot: seven letters, then the version of its layout.
inline constexpr std::string_view kSnapshotMagic = "VESTWLDC";

/// Convenient owner of Model, State and Scratch. Not thread-safe; step() is real-time safe after
/// construction.
class World {
 public:
  /// @throws std::invalid_argument with object, field, value and what is allowed
  explicit World(const Description& description, int threads = 1);
  /// Any number of Worlds share one Model (buildModel), also in different threads.
  explicit World(std::shared_ptr<const WorldModel> model, int threads = 1);
  ~World();
  World(World&&) noexcept;
  World& operator=(World&&) noexcept;

  /// One step of input.dt (bounded: 1e-6 … 0.01 s). Allocates nothing, logs nothing, throws nothing.
  Status step(const StepInput& input, StepReport& report);

  const Description& description() const;
  std::uint64_t steps() const;
  double time() const;             ///< s since loading
  std::uint32_t revision() const;  ///< of the world's topology
  std::size_t objectCount() const;
  std::size_t knotCount(std::size_t object) const;
  const Topology& topology(std::size_t object) const;
  /// Triangles of knots that others touch (what ImpactInput::triangle counts), as they are now; dead ones
  /// stay.
  const std::vector<std::array<std::uint32_t, 3>>& contactTriangles(std::size_t object) const;
  const std::vector<std::uint8_t>& contactTriangleAlive(std::size_t object) const;
  /// Positions of an object's knots, m, world, x y z per knot, as float32 (what tissue/state carries).
  void positions(std::size_t object, float* xyz) const;
  void velocities(std::size_t object, float* xyz) const;  ///< m/s
  /// One knot, m, world; the object's first one where there is no such knot.
  Eigen::Vector3d knotAt(std::size_t object, std::size_t knot) const;
  /// Largest absolute strain of the links at each knot, no unit.
  void strain(std::size_t object, float* per_knot) const;
  /// Greatest equivalent stress at each knot, Pa: of links by the object's law with what heat and edits did
  /// to it, of finite elements by von Mises. Dampers are not in it.
  void stress(std::size_t object, float* per_knot) const;
  /// Any field, per knot. Objects without it (rigid) are at body temperature, whole and perfused.
  void field(std::size_t object, Field kind, float* per_knot) const;
  /// Heat that instruments brought in and where it went, J, all objects.
  interaction::HeatLedger heat() const;
  /// Sum of the forces with which fixed knots, tethers and suspensions hold the object, N, world: the
  /// reaction of its attachments.
  Eigen::Vector3d reaction(std::size_t object) const;
  Energy energy() const;
  void attachments(std::vector<Attachment>& out) const;
  void slings(std::vector<SlingView>& out) const;
  void suspensions(std::vector<SuspensionView>& out) const;
  void threads(std::vector<ThreadView>& out) const;
  void needles(std::vector<NeedleView>& out) const;
  /// What holds the held nodes of all sutures, over the last part of the last step: force, N, and moment
  /// about the node, N·m, of the holder on the thread, world; in the order of suture::Model::held.
  const std::vector<suture::Reaction>& rodReactions() const;
  /// Deltas since a revision, in order; false if it is older than the last kDeltaHistory ones (or not of this
  /// history: after reset and restore it begins anew), then send the whole topology.
  bool deltasSince(std::uint32_t revision, std::vector<TopologyDelta>& out) const;
  /// A link dies. False if there is none, or it is dead. Between steps; in a recorded session use
  /// StepInput::requests, which do the same.
  bool removeLink(std::size_t object, std::uint32_t link);
  /// P -> P, P': what lies on the side of the plane to which `normal` points goes to the copy, whose index is
  /// returned in `copy`: links, hinges, contact triangles, binding of the skin, anchors. False if there is no
  /// such knot or no room.
  bool splitKnot(std::size_t object, std::uint32_t knot, const Eigen::Vector3d& normal, std::uint32_t& copy);
  /// XXH64 over the State's little-endian bytes, objects in scene order.
  std::uint64_t stateHash() const;

  /// Snapshot as bytes (versioned, with scene_hash); restore is all or nothing.
  void save(std::vector<std::uint8_t>& bytes) const;
  /// @throws std::invalid_argument naming what does not fit
  void restore(const std::vector<std::uint8_t>& bytes);
  void reset();
  /// Goes on where a World of an earlier state of the scene is: its step, time, instruments, and the State of
  /// each object and thread of which both scenes say the same. Where an object begins may differ. What holds
  /// on to those alone (connections, grasps, clips, slings, suspensions, ways of needles) holds on. All else
  /// is as the scene says. An object is stepped by the scene's `dt`: with another one nothing is kept.
  /// Energies go on being counted, without what the change brought in. Between steps of both.
  /// @return per object of `before`: its number here, kNotAdopted where it did not keep its State
  std::vector<std::uint32_t> adopt(const World& before);

  /// Fixed number of worker threads; results are the same bits for any.
  void setThreads(int threads);
  /// These threads, for what else belongs to a step: between two steps, and by who steps it alone.
  solver::Pool& pool() const;
  /// Name of the kernel level in use (baseline, avx2 …); environment variable VEST_KERNEL forces one.
  std::string_view kernelLevel() const;

  /// Energy accounting of dampers costs about a third more time; off at first. Work of the tools and the heat
  /// of contacts are counted always.
  void accountEnergy(bool on);
  /// Fills StepReport::stage_seconds (predict, collide, interact, solve, velocities, report); off at first.
  void measureStages(bool on);
  /// What was built: sub-steps and bounds per object, for tables and tests.
  const WorldModel& model() const;
  /// What evolves, to read: for tests, tables and inspection.
  const WorldState& state() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Strict loader (docs/scene_format.md). @throws std::invalid_argument: file, line, field, value, what is
/// allowed.
Description loadScene(const std::string& path);

}  // namespace vest::scene
