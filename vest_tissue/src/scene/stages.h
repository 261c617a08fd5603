#pragma once

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>

#include "body.h"
#include "delta_history.h"
#include "object_arrays.h"
#include "vest_tissue/base/nearest.h"
#include "vest_tissue/net/knot_loops.h"
#include "vest_tissue/scene/world.h"
#include "vest_tissue/scene/world_model.h"
#include "vest_tissue/scene/world_scratch.h"
#include "vest_tissue/solver/pool.h"

namespace vest::scene {

/// What the stages of a step work on.
struct Context {
  const WorldModel& model;
  WorldState& state;
  WorldScratch& scratch;
  const StepInput& input;
  StepReport& report;
  solver::Pool& pool;
  const Shares& shares;
  double dt;
  int stretch;   ///< sub-steps and batches are those of the description times this (a longer dt needs more)
  bool account;  ///< energy accounting
  net::KernelLevel level = net::KernelLevel::Baseline;
  DeltaHistory* deltas = nullptr;
  const Body& body(std::size_t object) const { return *model.objects[object].body; }
};

/// Work on all objects that deform, in parallel.
template <typename Work>
void eachBody(Context& c, Work work) {
  auto at = [&](std::size_t i) { work(c.shares.bodies[i]); };
  c.pool.each(c.shares.body_ends, at);
}

/// The objects that deform, by what a step of each costs: as equal for all threads as their number allows.
Shares shareOut(const WorldModel& model, std::size_t threads);

/// Stages in the order in which a step runs them.
bool checkInput(const StepInput& input);                      ///< finite numbers, dt in range
void predict(Context& c);                                     ///< edits, impacts, requests; each object
void moveProxies(Context& c);                                 ///< tools follow what is commanded
void takeLoads(Context& c);                                   ///< steady forces from outside
void accountLoads(Context& c);                                ///< their work in this step
void collide(Context& c);                                     ///< boxes, tools, cavity, organs
void interact(Context& c);                                    ///< jaws: grasp, hold, slip, release
void suspend(Context& c);                                     ///< jaws: hang up, take off
void solve(Context& c);                                       ///< batches of sub-steps
bool settleVelocities(Context& c, std::string_view& faulty);  ///< false: not a state to go on from
void takeLoops(Context& c);                                   ///< pushers with the loops that they carry
void touchThreads(Context& c);   ///< what threads lie on, after what stands in the way has been placed
void handleThreads(Context& c);  ///< jaws and scissors on threads
void handleNeedles(Context& c);  ///< jaws on needles
void stepThreads(Context& c,
                 int part);  ///< one of ThreadModel::steps; their forces are held until the next one
bool settleThreads(Context& c, std::string_view& faulty);  ///< breaks what bears no more; false: a fault
void fasten(Context& c);                                   ///< clips, slings
void stepHeat(Context& c);                                 ///< electrodes, temperature, damage
void cut(Context& c);                                      ///< blades: what they swept is divided
void tear(Context& c,
          std::size_t object);  ///< links that are stretched further than they bear, and the surface
void dropLoose(Context& c);     ///< parts that a cut left without hold lose what carried them in their place
void tell(Context& c);          ///< contact models, events
void feelImage(Context& c);     ///< needle and probe in a patient's image: adds to the contact models
void keepBackup(Context& c);
void keepShape(Context& c, std::size_t object);  ///< before input changes it
void keepRings(Context& c, std::size_t object);  ///< before the pulse widens them
void restoreBackup(Context& c);                  ///< the State before the step; what moved is at rest
/// So that keeping allocates nothing.
void reserveBackup(const WorldModel& model, WorldState& state, WorldScratch& scratch);

/// Changes the topology and keeps the delta. False: nothing has changed.
bool applyRequest(const WorldModel& model, WorldState& state, DeltaHistory& deltas,
                  const TopologyRequest& request, std::uint32_t& copy);
/// Station (m) of a place on a triangle of knots, which may be copies; NaN where the tube map knows none of
/// them.
double stationOf(const WorldModel& model, const WorldState& state, std::size_t object,
                 const std::array<std::uint32_t, 3>& knots, const std::array<double, 3>& weights);

/// Organs that are connected, or touch or overlap in the scene as it is saved, belong together by design
/// (vessels in their ligament, a tube on its mesosalpinx): they move together and do not collide, or contacts
/// would fight the connections (docs/decisions/0015-…). With full contact that holds where they do so.
/// Likewise a knot may lie as deep in a rigid object as at the start.
void ignoreDesignedContacts(WorldModel& model);
/// Threads and needles of the model, once its objects stand. They take part in the exchange between objects,
/// no more than four times a step.
void buildThreads(WorldModel& model);
/// Which objects nothing holds from the start (ObjectConstants::floats).
void findFloating(WorldModel& model);
/// Cutting's part of a built model, its room in a State, and its scratch.
void buildCut(const Object& object, ObjectState& s, interaction::CutConstants& c);
void reserveCut(const WorldModel& model, WorldState& state);
void reserveCut(const WorldModel& model, interaction::CutScratch& scratch);

/// Parts of the above in files of their own.
void contract(Context& c, std::size_t object);  ///< forces of an organ that moves
void findToolContacts(Context& c, std::size_t object);
/// Places, normals and stiffness of an object's contacts as it is within the step, after this fraction of it.
void renewContacts(Context& c, std::size_t object, double fraction);
void findCavityContacts(Context& c, std::size_t object);
void findOrganPairs(Context& c);
/// m: the furthest that a knot of the object went in this step, and a little more.
float movedBy(const Context& c, std::size_t object);
/// What this step moved (ObjectState::way), once it is known to stand.
void measureWays(Context& c);
void findOrganContacts(Context& c);
void placeTools(Context& c);
void renewSides(Context& c);
/// What was cut: work that the blade owes, and an event. `place`: m, of the triangle that was cut last.
void tellCut(Context& c, std::size_t object, double area, std::uint32_t triangle,
             const Eigen::Vector3d& place, std::uint8_t instrument, bool electric);
/// Parts that came off by it: an event each.
void tellSeparated(Context& c, std::size_t object, std::uint32_t count, std::uint32_t triangle,
                   std::uint8_t instrument);
/// Heat between two knots. @param conductance W/K  @param dt s
void exchangeHeat(Context& c, std::size_t object, std::uint32_t p, std::uint32_t q, float conductance,
                  double dt);

bool removeClip(Context& c, std::uint64_t id);
/// No unit, 0 … 1: how much of what they can close clips and slings have closed now.
double clipClosure(const ObjectState& state, const interaction::Clip& clip);
double slingClosure(const ObjectState& state, const interaction::Sling& sling);
void addFasteners(const WorldState& state, std::vector<Attachment>& out);
void attachSling(const WorldState& state, const interaction::Sling& sling, Attachment& out);
void drawSling(const interaction::Sling& sling, SlingView& view);
void addSuspensions(const WorldModel& model, const WorldState& state, std::vector<Attachment>& out);
void drawSuspension(const WorldState& state, const interaction::Suspension& suspension, SuspensionView& view);
/// N, world: of all suspensions on an object.
Eigen::Vector3d suspensionForce(const WorldState& state, std::size_t object);
double suspensionEnergy(const WorldState& state);  ///< J, in their springs
void fastenClips(Context& c);
void holdClips(Context& c, std::size_t object, double dt);  ///< after each sub-step of an object, any thread
/// Forces between the parts of clips that hold several objects; in a batch, for objects that begin one.
void joinClips(Context& c, int batch, int batches);
/// Clips on finite elements: groups of the object's implicit step, before it, and what they took, after it.
void gatherClips(Context& c, std::size_t object, double dt);
void tellClips(Context& c, std::size_t object, double dt);
/// What each sling draws in, and the way of the pusher that holds it: before the sub-steps of a step.
void gatherSlings(Context& c);
/// After each sub-step of `dt` of an object, any thread. `fraction`: of the step that has passed.
void holdSlings(Context& c, std::size_t object, double fraction, double dt);
void fastenSlings(Context& c);

/// Ring of an object's tube as it is now (net::CutRings).
inline net::CutRings::Ring ringNow(const Context& c, std::size_t object, std::size_t ring, bool above) {
  return c.scratch.objects[object].rings.ring(c.model.objects[object].tube, ring, above);
}

/// An event of an object in this step.
inline Event eventOf(const Context& c, EventKind kind, int instrument, std::size_t object,
                     std::uint32_t element) {
  Event e;
  e.kind = kind;
  e.step = c.state.step;
  e.instrument = static_cast<std::int8_t>(instrument);
  e.object = static_cast<std::uint16_t>(object);
  e.element = element;
  return e;
}
/// An event of the thread that a node belongs to.
Event threadEvent(const Context& c, EventKind kind, int tool, std::uint32_t node);
/// Event with room checked: the report's capacity is fixed.
void emit(Context& c, const Event& event);

/// Bit of an instrument.
inline void setBit(std::uint8_t& bits, int instrument, bool on) {
  const auto bit = static_cast<std::uint8_t>(1u << instrument);
  bits = static_cast<std::uint8_t>(on ? bits | bit : bits & ~bit);
}
inline const float* row(const ObjectState& s, net::Block::KnotRow r) {
  return s.block.row(r);
}
inline Eigen::Vector3d knotPosition(const ObjectState& s, std::uint32_t k) {
  using net::Block;
  return {row(s, Block::X)[k], row(s, Block::Y)[k], row(s, Block::Z)[k]};
}
inline Eigen::Vector3d knotVelocity(const ObjectState& s, std::uint32_t k) {
  using net::Block;
  return {row(s, Block::VX)[k], row(s, Block::VY)[k], row(s, Block::VZ)[k]};
}
inline void setMotion(ObjectState& s, std::uint32_t k, const Eigen::Vector3d& place,
                      const Eigen::Vector3d& velocity) {
  using net::Block;
  for (int axis = 0; axis < 3; ++axis) {
    s.block.row(static_cast<Block::KnotRow>(Block::X + axis))[k] = static_cast<float>(place[axis]);
    s.block.row(static_cast<Block::KnotRow>(Block::VX + axis))[k] = static_cast<float>(velocity[axis]);
  }
}
/// Adds to the forces that a knot is held with over a batch, N.
inline void addHeld(ObjectState& s, std::uint32_t k, const Eigen::Vector3d& f) {
  using net::Block;
  for (int axis = 0; axis < 3; ++axis)
    s.block.row(static_cast<Block::KnotRow>(Block::HX + axis))[k] += static_cast<float>(f[axis]);
}
/// m: from an object's surface to a tool's at the end of a step.
inline double gapOf(const ObjectState& s, const contact::ToolContact& t) {
  Eigen::Vector3d q = Eigen::Vector3d::Zero();
  for (int e = 0; e < 3; ++e) q += knotPosition(s, t.knots[e]) * static_cast<double>(t.weights[e]);
  const Eigen::Vector3d normal(t.normal[0], t.normal[1], t.normal[2]),
      axis(t.start[0] + t.travel[0], t.start[1] + t.travel[1], t.start[2] + t.travel[2]);
  return normal.dot(axis - q) - t.reach;
}
/// Way (m) and velocity (m/s) from the second end of a contact to the first.
inline void apart(const WorldState& state, const OrganContact& r, Eigen::Vector3d& way,
                  Eigen::Vector3d& rate) {
  way.setZero(), rate.setZero();
  for (std::size_t e = 0; e < 3; ++e)
    for (std::size_t n = 0; n < 2; ++n) {
      const ContactEnd& end = r.ends[n];
      const double w = n == 0 ? end.weights[e] : -end.weights[e];
      way += w * knotPosition(state.objects[end.object], end.knots[e]);
      rate += w * knotVelocity(state.objects[end.object], end.knots[e]);
    }
}
/// What tissue or thread does to an instrument at a place: impulse N·s, place m.
inline void give(contact::ToolLoad& load, const Eigen::Vector3d& impulse, const Eigen::Vector3d& place) {
  const Eigen::Vector3d moment = place.cross(impulse);
  load.touched = true;
  for (int e = 0; e < 3; ++e) load.impulse[e] += impulse[e], load.moment[e] += moment[e];
}
/// m, world.
inline Eigen::Vector3d centreOf(const ObjectState& s, const net::CutRings::Ring& ring) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const auto k : ring) sum += knotPosition(s, k);
  return sum / static_cast<double>(std::max<std::size_t>(ring.count, 1));
}
/// A held knot (object, knot): as stiff as its mass bears beside the object's own links.
template <class Hold>
void stiffen(const Context& c, Hold& held) {
  const double mass = static_cast<double>(row(c.state.objects[held.object], net::Block::kMass)[held.knot]),
               omega2 = c.model.objects[held.object].contact_omega_squared;
  held.stiffness = mass * omega2;
  held.damping = 0.6 * mass * std::sqrt(omega2);
}
/// 1/kg: how a knot answers to contacts. A fixed knot counts with its own mass, not as immovable: a contact
/// whose place is almost on it would otherwise be as stiff as the tiny weight of its free neighbour allows,
/// and push the tool with any force at all.
inline double contactInverseMass(const ObjectState& s, std::uint32_t k) {
  const double inverse = row(s, net::Block::kInverseMass)[k];
  return inverse > 0.0 ? inverse : 1.0 / static_cast<double>(row(s, net::Block::kMass)[k]);
}

}  // namespace vest::scene
