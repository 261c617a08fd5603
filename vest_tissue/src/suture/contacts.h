#pragma once

#include <array>
#include <vector>

#include "vest_tissue/suture/rod.h"

/// Threads that touch themselves, each other, and cylinders: as capsules, with Coulomb friction. Contacts are
/// rows on the factored matrix of a Newton pass, solved by block Gauss–Seidel on displacement over the
/// sub-step, so that what sticks does not move at all.
namespace vest::suture {

/// How much friction a contact bears. Polymers' surfaces shear at a stress that grows with pressure from one
/// without any (Towle 1974, doi:10.1007/978-1-4613-9942-1_10), so that the coefficient falls with load: as it
/// does between threads (Gupta, Wolf and Postlethwait 1985, Surg Gynecol Obstet 161:12). The form is assumed:
///
///     F ≤ N·(friction − fall·N/(N + half))
///
/// F grows with N and is concave, so that the forces that are allowed are a convex set, as Coulomb's cone.
struct Friction {
  double friction = 0.0, fall = 0.0;  ///< no unit
  double half = 0.0;                  ///< N
};
inline double coefficient(const Friction& f, double load) {
  return f.fall > 0.0 ? f.friction - f.fall * load / (load + f.half) : f.friction;
}

/// A pair that may touch within the sub-step.
struct Near {
  LiveContact live;
  Friction friction;
  double reach = 0.0;  ///< m, distance of the axes at which they touch
};

/// A near pair in one pass.
struct Row {
  Index near = 0;
  std::array<Index, 4> node{};  ///< kNone: none, or held
  std::array<double, 4> weight{};
  Eigen::Matrix3d axes;   ///< columns: normal, two tangents
  Eigen::Vector3d gap;    ///< m: along the normal, and slip since the sub-step's start
  Eigen::Vector3d force;  ///< N, in the axes
  Eigen::Vector3d last;   ///< N, likewise, after the sweep before
  bool doubled = false;   ///< another row has the same point
  bool far = false;       ///< apart, before the free change and after it
};

/// What a row does to itself.
struct Own {
  Eigen::Matrix3d D, inverse;  ///< m/N, in its axes; N/m
  double trace = 0.0;          ///< 1 over that across
};

/// An unknown of the active set: a row's force along an axis, or its load and the friction with it.
struct Unknown {
  Index row = 0, axis = 0;
  bool sticks = false;
  Eigen::Vector3d along;  ///< of the row's force, in its axes
};

struct ContactScratch {
  explicit ContactScratch(const Model& model);
  struct Box {
    Eigen::Vector3d low, high;
    Index first = 0, end = 0;
  };
  std::vector<Box> boxes;               ///< of some neighbouring segments each
  std::vector<double> arc;              ///< m, of each segment's middle along its rod
  std::vector<Eigen::Vector3d> middle;  ///< m, of each segment
  std::vector<double> round;            ///< m: how far from its middle it may reach in the sub-step
  std::vector<Near> near;
  std::vector<Row> rows;
  std::vector<Index> touched, place;     ///< nodes that rows touch, ascending; and a node's number among them
  std::vector<Eigen::Matrix3d> answers;  ///< inverse between touched nodes
  bool answered = false;                 ///< `answers` are those of the present factor
  std::vector<double> coupling;          ///< between rows, in their axes: three columns of each
  std::vector<Own> own;                  ///< of each row
  std::vector<double> gaps;              ///< of all rows, with the forces of all
  std::vector<double> gaps_before;       ///< likewise, before the active set was solved
  std::vector<Unknown> unknowns;         ///< of the active set
  std::vector<double> system, answer;    ///< of their equations
  std::vector<Matrix6> leads;            ///< of the inverse, from a touched node to the one before
  std::vector<std::uint8_t> bearing;     ///< how each support bears in the Hessian
  std::size_t room = 0;                  ///< for rows
  bool full = false;                     ///< a near pair found no room
};

/// Nearest places p + s·u and q + t·v of two segments.
struct Closest {
  double s = 0.0, t = 0.0;  ///< 0 … 1
  bool across = false;      ///< inside both segments, not at an end: where a pass through shows
  Eigen::Vector3d between = Eigen::Vector3d::Zero();  ///< from the second to the first
};
/// @param line t is not limited
Closest closest(const Eigen::Vector3d& p, const Eigen::Vector3d& u, const Eigen::Vector3d& q,
                const Eigen::Vector3d& v, bool line);

std::size_t contactRoom(const Model& model);

/// Pairs that may touch in a sub-step of h from the state.
void findNear(const Model& model, const State& s, double h, ContactScratch& c);

/// How contacts with cylinders turn and move along segments, with the forces of the pass before, to the
/// Hessian in scratch.chain.
void addCurvature(const Model& model, const State& s, Scratch& scratch);

/// A new factor: what was known of its inverse is void.
void forgetAnswers(ContactScratch& c);

/// Contact forces of one pass; scratch.gradient loses them, scratch.change is then the constrained one.
/// False: there are none, and nothing has changed.
bool solveContacts(const Model& model, const State& before, const State& s, Scratch& scratch);

/// J, by which the potential of the contacts' forces, held as they are, grows over the whole of
/// scratch.change.
double contactWork(const Scratch& scratch);

/// Memory of couple() and findForces() for c.room rows.
void makeRoomForForces(ContactScratch& c);

/// How the force of each row moves each other row, from the answers of the nodes between which they are.
void couple(ContactScratch& c);

/// Forces of all rows, from those of the pass before: sweeps with momentum (Nesterov 1983), which ends where
/// it does harm. Where they go on, the active set is solved straight; back where that leads away.
void findForces(ContactScratch& c, Scratch& scratch);

/// What is near becomes the state's memory, and forces on nodes go to scratch.contact_force.
void keepContacts(const Model& model, State& s, Scratch& scratch);

}  // namespace vest::suture
