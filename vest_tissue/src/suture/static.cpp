#include <algorithm>
#include <cmath>

#include "contacts.h"
#include "passes.h"

namespace vest::suture {
namespace {

using Eigen::Vector3d;

constexpr int kMostStaticPasses = 20000;
constexpr int kMostStaticParts = 4000;  ///< of the holders' way
constexpr double kAtRest = 1e-8;        ///< of a segment's length, and rad: a smaller change is none
constexpr double kNoInertia = 20.0;  ///< times the slowest time: inertia is then 1e-5 of the least stiffness
constexpr int kSteps = 200;          ///< in the time that rods take, where they touch
constexpr int kMostTimes = 200;      ///< of those: until they are at rest
constexpr double kPush = 1e-3;       ///< of a segment's length, off an unstable equilibrium

/// The slowest bending time of the longest rod, s.
double slowest(const Model& m) {
  double most = 0.0;
  for (const Strand& strand : m.strands) {
    double l = 0.0;
    for (Index k = 0; k < strand.segments; ++k) l += m.length[strand.first + k];
    most = std::max(most, l * l * std::sqrt(strand.section.linear_density / strand.section.bend));
  }
  return most;
}

/// Parts of the way of all holders in which none moves by more than half a segment or turns by 0.2 rad.
int partsOfDrive(const Model& m) {
  double most = 1.0;
  for (const HeldModel& h : m.held) {
    const double l = m.length[h.node] > 0.0 ? m.length[h.node] : m.length[h.node - 1];
    double parts = 0.0;
    for (std::size_t i = 1; i < h.drive.size(); ++i)
      parts += std::max(2.0 * (h.drive[i].place - h.drive[i - 1].place).norm() / l,
                        5.0 * std::abs(h.drive[i].angle - h.drive[i - 1].angle));
    most = std::max(most, parts);
  }
  return static_cast<int>(std::min(std::ceil(most), static_cast<double>(kMostStaticParts)));
}

void rest(State& s) {
  for (Vector3d& v : s.velocity) v.setZero();
  for (Vector3d& w : s.spin) w.setZero();
}

/// Greatest unbalanced force of the last pass, N, and what rounding and 1e-9 of the rods' own forces allow.
bool balanced(const Model& m, const State& s, const Scratch& scratch) {
  double left = 0.0, own = 0.0, rounding = 0.0;
  for (const Strand& strand : m.strands) {
    const Section& c = strand.section;
    for (Index k = 0; k < strand.nodes; ++k) {
      const Index i = strand.first + k;
      own = std::max(own, m.force[i].norm());
      if (m.held_at[i] == kNone) left = std::max(left, scratch.gradient[i].head<3>().norm());
      if (k >= strand.segments) continue;
      left = std::max(left, scratch.gradient[i].tail<3>().norm() / m.length[i]);
      own =
          std::max(own, Vector3d(c.shear, c.shear, c.stretch).cwiseProduct(strainOf(m, s, strand, i)).norm());
    }
    rounding = std::max(rounding, 1e-13 * c.stretch);
  }
  return left <= 1e-9 * own + rounding;
}

/// How long the fastest rod takes to bend or to fall, s.
double quickest(const Model& m) {
  double least = slowest(m);
  for (const Strand& strand : m.strands) {
    double length = 0.0, mass = 0.0, load = 0.0;
    for (Index k = 0; k < strand.nodes; ++k) {
      const Index i = strand.first + k;
      mass += m.mass[i], load += m.force[i].norm();
      if (k < strand.segments) length += m.length[i];
    }
    if (load > 0.0) least = std::min(least, std::sqrt(length * mass / load));
  }
  return least;
}

/// Damped steps from the start, the holders' way first, until nothing moves. Passes of statics are as long as
/// they like, and would lead threads through each other. @return whether they came to rest
bool settleBySteps(const Model& m, double end, State& s, Scratch& scratch) {
  Model damped = m;
  const double time = quickest(m), h = time / kSteps, start = s.time;
  for (Strand& strand : damped.strands) strand.section.damping = std::max(strand.section.damping, 2.0 / time);
  const int way = end > start ? std::max(20 * kSteps, 4 * partsOfDrive(m)) : 0;
  for (HeldModel& held : damped.held)
    for (DriveRow& row : held.drive)
      row.t = start + (row.t - start) * (way * h / std::max(end - start, 1e-300));
  for (int k = 0; k < way; ++k)
    if (step(damped, s, scratch, h) == StepStatus::Fault) return false;
  std::vector<Vector3d> before;
  for (int times = 0; times < kMostTimes; ++times) {
    before = s.position;
    for (int k = 0; k < kSteps; ++k)
      if (step(damped, s, scratch, h) == StepStatus::Fault) return false;
    double most = 0.0;
    for (const Strand& strand : m.strands)
      for (Index i = strand.first; i < strand.first + strand.nodes; ++i)
        most = std::max(most, (s.position[i] - before[i]).norm() / m.length[strand.first]);
    if (most < 1e-3) return true;
  }
  return false;
}

/// One pass of h from rest: the less h, the nearer it stays. Touching: nothing has moved.
PassResult creep(const Model& m, State& s, Scratch& scratch, double h, bool first) {
  for (Index k = 0; k < m.joints.size(); ++k) absorbTwist(m, scratch.held_frame, k, s);
  copyMotion(s, scratch.before);
  remember(m, s, scratch);
  findNear(m, s, 0.0, *scratch.contacts);
  const PassResult result = pass({m, scratch.before, h, 1.0}, s, first, scratch);
  if (!result.touching) keepContacts(m, s, scratch);
  return result;
}

/// Leaves a place that symmetry keeps. The directions repeat after no small number of nodes.
void push(const Model& m, State& s) {
  for (const Strand& strand : m.strands) {
    for (Index k = 0; k < strand.nodes; ++k) {
      const Index i = strand.first + k;
      if (m.held_at[i] != kNone) continue;
      const double l = m.length[i] > 0.0 ? m.length[i] : m.length[i - 1], along = (k + 0.5) / strand.nodes;
      // One arch, and less of two: whatever buckles has a part in them.
      const double one = along * (1.0 - along), two = one * (0.5 - along);
      s.position[i] += kPush * l * (one * Vector3d(1.0, 0.7, 0.4) + two * Vector3d(-0.5, 0.3, 0.8));
    }
  }
}

}  // namespace

void findReactions(const Model& m, const State& s, Scratch& scratch) {
  copyMotion(s, scratch.before);
  aim(m, s.time, scratch);
  remember(m, s, scratch);
  for (Vector3d& v : scratch.before.velocity) v.setZero();
  for (Vector3d& w : scratch.before.spin) w.setZero();
  assemble({m, scratch.before, 1.0}, s, true, scratch);
  for (std::size_t n = 0; n < m.held.size(); ++n)
    scratch.reactions[n].force -= scratch.contact_force[m.held[n].node];
}

namespace {

/// Passes without contacts. False: rods touch.
bool solveApart(const Model& m, State& s, Scratch& scratch, StaticReport& report) {
  double end = s.time;
  for (const HeldModel& h : m.held) end = std::max(end, h.drive.back().t);
  const double slow = slowest(m), start = s.time;
  const int parts = partsOfDrive(m);
  rest(s);
  double h = 0.1 * slow;
  for (int k = 1; k <= parts; ++k) {
    aim(m, start + (end - start) * k / parts, scratch);
    for (int i = 0; i < 3; ++i, ++report.iterations) {
      const PassResult r = creep(m, s, scratch, h, i == 0);
      if (r.touching) return false;
      if (r.factor == Factor::None) return true;
    }
  }
  s.time = end;
  for (; report.iterations < kMostStaticPasses; ++report.iterations) {
    const PassResult r = creep(m, s, scratch, h, false);
    if (r.touching) return false;
    if (r.factor == Factor::None) return true;
    if (r.factor == Factor::Exact && r.whole) {
      if (h >= kNoInertia * slow && (r.change < kAtRest || balanced(m, s, scratch))) {
        report.converged = true;
        break;
      }
      h = std::min(2.0 * h, kNoInertia * slow);
      continue;
    }
    if (r.factor != Factor::Exact && r.change < kAtRest) {
      push(m, s);
      h = slow;
    }
    h = std::max(0.4 * h, 1e-4 * slow);
  }
  return true;
}

}  // namespace

StaticReport solveStatic(const Model& m, State& s, Scratch& scratch) {
  StaticReport report;
  const State start = s;
  double end = s.time;
  for (const HeldModel& h : m.held) end = std::max(end, h.drive.back().t);
  // Passes that are long go through a cylinder and see nothing of it.
  if (!m.cylinders.empty() || !solveApart(m, s, scratch, report)) {
    s = start;
    report.converged = settleBySteps(m, end, s, scratch);
    s.time = end;
  }
  rest(s);
  findReactions(m, s, scratch);
  for (std::size_t i = 0; i < m.mass.size(); ++i) {
    report.load = std::max(report.load, m.force[i].norm());
    if (m.held_at[i] == kNone)
      report.residual =
          std::max(report.residual, (scratch.gradient[i].head<3>() - scratch.contact_force[i]).norm());
  }
  for (const Reaction& r : scratch.reactions) report.load = std::max(report.load, r.force.norm());
  return report;
}

}  // namespace vest::suture
