#include <algorithm>
#include <cmath>

#include "contacts.h"
#include "elements.h"
#include "passes.h"
#include "quaternions.h"

namespace vest::suture {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr int kMostPasses = 8;          ///< of Newton a sub-step
constexpr int kTouchPasses = 6;         ///< with contacts: each pass solves them anew
constexpr double kSettled = 1e-5;       ///< of a segment's length, and rad: a smaller change ends the passes
constexpr double kTouchSettled = 5e-4;  ///< with contacts, whose forces are less exact
constexpr double kRests = 2e-3;         ///< with supports: less is as near as they come
constexpr double kSmall = 0.02;         ///< a change after which the factor serves once more
constexpr double kMostTurn = 0.7;       ///< rad: of a segment in one pass
constexpr double kPartTurn = 0.3;       ///< rad: free rotation that a sub-step may have
constexpr int kMostHalvings = 6;        ///< of a pass that raises the potential
constexpr int kMostParts = 8;           ///< of a step

}  // namespace

void aim(const Model& m, double time, Scratch& s) {
  for (std::size_t h = 0; h < m.held.size(); ++h) {
    const HeldModel& held = m.held[h];
    const auto after = std::upper_bound(held.drive.begin(), held.drive.end(), time,
                                        [](double t, const DriveRow& row) { return t < row.t; });
    DriveRow row = after == held.drive.begin() ? *after : *(after - 1);
    if (after != held.drive.begin() && after != held.drive.end()) {
      const double share = (time - row.t) / (after->t - row.t);
      row.place += share * (after->place - row.place);
      row.angle += share * (after->angle - row.angle);
    }
    s.target[h] = row.place;
    s.held_frame[h] = row.angle == 0.0 ? held.frame : (held.frame * about(row.angle)).normalized();
  }
}

namespace {

/// Sub-steps of a step: as many as keep free rotation and motion small.
int partsOf(const Model& m, const State& s, const Scratch& scratch, double dt) {
  double turn = 0.0, way = 0.0;
  for (const Strand& strand : m.strands) {
    for (Index k = 0; k < strand.segments; ++k) {
      const Index i = strand.first + k;
      turn = std::max(turn, s.spin[i].squaredNorm());
      way = std::max(way, s.velocity[i].squaredNorm() / (m.length[i] * m.length[i]));
      way = std::max(way, s.velocity[strand.next(i)].squaredNorm() / (m.length[i] * m.length[i]));
    }
  }
  for (std::size_t h = 0; h < m.held.size(); ++h) {  // target is that of the step's end
    const Index i = m.held[h].node;
    const double l = m.length[i] > 0.0 ? m.length[i] : m.length[i - 1];
    way = std::max(way, (scratch.target[h] - s.position[i]).squaredNorm() / (l * l * dt * dt));
  }
  const double most = std::max(std::sqrt(turn) * dt / kPartTurn, std::sqrt(way) * dt / 0.5);
  return most <= 1.0 ? 1 : most <= 2.0 ? 2 : most <= 4.0 ? 4 : kMostParts;
}

/// Adds `share` of the change to the state.
void advance(const Model& m, const std::vector<Vector6>& change, double share, const State& from, State& to) {
  for (const Strand& strand : m.strands) {
    for (Index k = 0; k < strand.nodes; ++k) {
      const Index i = strand.first + k;
      to.position[i] = from.position[i] - share * change[i].head<3>();
      if (k < strand.segments) to.frame[i] = turned(from.frame[i], -share * change[i].tail<3>());
    }
  }
}

struct Size {
  double turn = 0.0, way = 0.0;  // rad, of a segment's length
  double bent = 0.0;             // rad, and of a segment's length: the Hessian does not see what all nodes do
};
Size sizeOf(const Model& m, const std::vector<Vector6>& change) {
  Size size;
  for (const Strand& strand : m.strands) {
    for (Index k = 0; k < strand.segments; ++k) {
      const Index i = strand.first + k;
      size.turn = std::max(size.turn, change[i].tail<3>().squaredNorm());
      const double squared = m.length[i] * m.length[i];
      size.way = std::max(size.way, change[i].head<3>().squaredNorm() / squared);
      size.bent = std::max(size.bent,
                           (change[strand.next(i)].head<3>() - change[i].head<3>()).squaredNorm() / squared);
    }
  }
  size.bent = std::sqrt(std::max(size.turn, size.bent));
  size.turn = std::sqrt(size.turn), size.way = std::sqrt(size.way);
  return size;
}

/// Gradient and factor at the state. The exact Hessian where it is positive definite.
Factor linearise(const Potential& p, const State& s, Scratch& scratch) {
  for (const Factor kind : {Factor::Exact, Factor::Taut}) {
    assemble(p, s, kind == Factor::Exact, scratch);
    forgetAnswers(*scratch.contacts);
    bool good = true;
    for (BlockChain& chain : scratch.chain) good = good && chain.factorise();
    if (good) return kind;
  }
  return Factor::None;
}

void solve(const Model& m, Scratch& scratch) {
  std::copy(scratch.gradient.begin(), scratch.gradient.end(), scratch.change.begin());
  for (std::size_t n = 0; n < m.strands.size(); ++n)
    scratch.chain[n].solve(scratch.change.data() + m.strands[n].first);
}

}  // namespace

void remember(const Model& m, const State& s, Scratch& scratch) {
  for (const Strand& strand : m.strands) {
    for (Index k = 0; k < strand.segments; ++k)
      scratch.strain_then[strand.first + k] = strainOf(m, s, strand, strand.first + k);
    for (Index k = strand.joints_begin; k < strand.joints_end; ++k)
      scratch.curvature_then[k] = bendOf(m, s, scratch.held_frame, k) / m.joints[k].length;
  }
}

namespace {

/// Twist goes to the offsets; bending beyond the yield moment becomes natural.
void keepShape(const Model& m, State& s, const Scratch& scratch) {
  for (const Strand& strand : m.strands) {
    const double most = strand.section.yield_moment / strand.section.bend;
    for (Index k = strand.joints_begin; k < strand.joints_end; ++k) {
      absorbTwist(m, scratch.held_frame, k, s);
      if (most == 0.0) continue;
      Vector3d off = bendOf(m, s, scratch.held_frame, k) / m.joints[k].length - s.natural_curvature[k];
      off.z() = 0.0;
      const double size = off.norm();
      if (size > most) s.natural_curvature[k] += off * (1.0 - most / size);
    }
  }
}

}  // namespace

PassResult pass(const Potential& p, State& s, bool first, Scratch& scratch, Factor kept) {
  PassResult result;
  result.factor = kept;
  if (kept == Factor::None || !assembleGradient(p, s, scratch)) result.factor = linearise(p, s, scratch);
  if (result.factor == Factor::None) return result;
  solve(p.model, scratch);
  const bool touching = solveContacts(p.model, p.before, s, scratch);
  if (touching) solve(p.model, scratch);
  result.touching = touching;
  const Size size = sizeOf(p.model, scratch.change);
  double share = size.turn > kMostTurn ? kMostTurn / size.turn : 1.0;
  result.change = std::max(size.turn, size.way);
  result.bent = size.bent;
  if (!first && result.change > (kept == Factor::None && !touching ? 1e-8 : kSmall)) {
    // Held nodes are where they are to be: the potential has to fall, that of the contacts' forces with it.
    copyMotion(s, scratch.trial);  // with its offsets
    const double now = valueOf(p, s, scratch), pushed = touching ? contactWork(scratch) : 0.0;
    double slope = 0.0;
    for (std::size_t i = 0; i < scratch.change.size(); ++i)
      slope += scratch.change[i].dot(scratch.gradient[i]);
    for (int k = 0; k < kMostHalvings; ++k, share *= 0.5) {
      advance(p.model, scratch.change, share, s, scratch.trial);
      if (valueOf(p, scratch.trial, scratch) + share * pushed <=
          now - 1e-4 * share * slope + 1e-12 * std::abs(now))
        break;
    }
  }
  advance(p.model, scratch.change, share, s, s);
  result.whole = share == 1.0;
  for (std::size_t h = 0; h < p.model.held.size() && result.whole; ++h)
    s.position[p.model.held[h].node] = scratch.target[h];
  return result;
}

void copyMotion(const State& from, State& to) {
  std::copy(from.position.begin(), from.position.end(), to.position.begin());
  std::copy(from.velocity.begin(), from.velocity.end(), to.velocity.begin());
  std::copy(from.frame.begin(), from.frame.end(), to.frame.begin());
  std::copy(from.spin.begin(), from.spin.end(), to.spin.begin());
  std::copy(from.offset.begin(), from.offset.end(), to.offset.begin());
  std::copy(from.natural_curvature.begin(), from.natural_curvature.end(), to.natural_curvature.begin());
  std::copy(from.severed.begin(), from.severed.end(), to.severed.begin());
  std::copy(from.contacts.begin(), from.contacts.begin() + from.contact_count, to.contacts.begin());
  to.contact_count = from.contact_count;
  to.time = from.time;
}

namespace {

bool finite(const State& s) {
  double sum = 0.0;
  for (const Vector3d& v : s.velocity) sum += v.squaredNorm();
  for (const Vector3d& w : s.spin) sum += w.squaredNorm();
  for (const Vector3d& x : s.position) sum += x.squaredNorm();
  return sum < 1e300;  // false for NaN
}

/// Passes until what is left is small. A factor serves as long as the state moves little from where it was
/// made: what a pass leaves then is about its own change times that way.
bool settle(const Potential& p, State& s, Scratch& scratch) {
  PassResult last;
  double moved = 1.0;  // since the factor was made
  for (int k = 0; k < (last.touching ? kTouchPasses : kMostPasses); ++k) {
    const bool keep = last.whole && last.factor == Factor::Exact && moved < kSmall;
    const double was = last.change;
    last = pass(p, s, k == 0, scratch, keep ? last.factor : Factor::None);
    ++scratch.passes;
    if (last.factor == Factor::None) return false;
    moved = keep ? moved + last.bent : last.bent;
    if (!last.whole) continue;
    // Contacts and supports that stick and slide by turns come no nearer at some point.
    const bool rests = k > 1 && last.change > 0.5 * was && (last.touching || last.change < kRests);
    if (rests || last.change < (last.touching ? kTouchSettled : kSettled) ||
        (!last.touching && scratch.supports.empty() && last.factor == Factor::Exact &&
         2.0 * last.change * moved < kSettled))
      break;
  }
  return true;
}

/// Two segments that were not near at the sub-step's start may have gone through each other: a node moved
/// further than its speed then let expect, by more than half of what is free between them at least.
bool ranAway(const Model& m, const State& before, const State& s, double h) {
  for (const Strand& strand : m.strands) {
    for (Index i = strand.threadFirst(); i < strand.first + strand.nodes; ++i) {
      const double most = 1.5 * (h * std::sqrt(before.velocity[i].squaredNorm()) + strand.section.radius);
      if ((s.position[i] - before.position[i]).squaredNorm() > most * most) return true;
    }
  }
  return false;
}

enum class Part : std::uint8_t { Done, RanAway, Fault };

/// @param share of the step @param last it is not to be made shorter
Part part(const Model& m, State& s, Scratch& scratch, double h, double end, double share, bool last) {
  copyMotion(s, scratch.before);
  for (const NeedleModel& n : m.needles) {  // Euler's equations: its axes are no axes of symmetry
    Vector3d& spin = scratch.before.spin[n.node];
    const Vector3d& inertia = m.inertia[n.node];
    spin -= h * spin.cross(Vector3d(inertia.cwiseProduct(spin))).cwiseQuotient(inertia);
  }
  remember(m, s, scratch);  // with the holders' frames of the start
  aim(m, end, scratch);
  const Potential p{m, scratch.before, h};
  findNear(m, s, h, *scratch.contacts);
  if (!settle(p, s, scratch)) return Part::Fault;
  if (!last && ranAway(m, scratch.before, s, h)) {
    std::copy(scratch.before.position.begin(), scratch.before.position.end(), s.position.begin());
    std::copy(scratch.before.frame.begin(), scratch.before.frame.end(), s.frame.begin());
    return Part::RanAway;
  }
  for (const Strand& strand : m.strands) {
    for (Index k = 0; k < strand.nodes; ++k) {
      const Index i = strand.first + k;
      s.velocity[i] = (s.position[i] - scratch.before.position[i]) / h;
      if (k >= strand.segments) continue;
      const Quaterniond turn = scratch.before.frame[i].conjugate() * s.frame[i];
      s.spin[i] = turn.vec() * ((turn.w() < 0.0 ? -2.0 : 2.0) / h);
    }
  }
  for (std::size_t n = 0; n < m.held.size(); ++n) s.position[m.held[n].node] = scratch.target[n];
  if (!m.held.empty()) assembleGradient(p, s, scratch);  // reactions
  settleSupports(p, s, share, scratch);
  keepContacts(m, s, scratch);
  for (std::size_t n = 0; n < m.held.size(); ++n)
    scratch.reactions[n].force -= scratch.contact_force[m.held[n].node];
  keepShape(m, s, scratch);
  return Part::Done;
}

}  // namespace

StepStatus step(const Model& m, State& s, Scratch& scratch, double dt) {
  copyMotion(s, scratch.backup);
  scratch.passes = scratch.sweeps = 0;
  scratch.contact_residual = 0.0;
  const double start = s.time;
  aim(m, start + dt, scratch);
  scratch.parts = partsOf(m, s, scratch, dt);
  bool good = true;
  for (Support& a : scratch.supports) a.force.setZero();
  aim(m, start, scratch);
  int width = kMostParts / scratch.parts;  // in eighths of the step
  for (int at = 0; at < kMostParts && good;) {
    const double share = static_cast<double>(width) / kMostParts;
    scratch.fraction_then = static_cast<double>(at) / kMostParts,
    scratch.fraction = scratch.fraction_then + share;
    const Part done =
        part(m, s, scratch, dt * share, start + dt * (at + width) / kMostParts, share, width == 1);
    good = done != Part::Fault;
    if (done == Part::RanAway) {
      aim(m, start + dt * at / kMostParts, scratch);  // back
      width /= 2, scratch.parts *= 2;
    } else {
      at += width;
    }
  }
  s.time = start + dt;
  if (good && finite(s)) return scratch.contacts->full ? StepStatus::Degraded : StepStatus::Ok;
  copyMotion(scratch.backup, s);
  return StepStatus::Fault;
}

double energy(const Model& m, const State& s) {
  double sum = 0.0;
  for (const Strand& strand : m.strands) {
    const Section& c = strand.section;
    for (Index k = 0; k < strand.nodes; ++k) {
      const Index i = strand.first + k;
      sum += 0.5 * m.mass[i] * s.velocity[i].squaredNorm() - m.force[i].dot(s.position[i]);
      if (k >= strand.segments) continue;
      sum += 0.5 * m.inertia[i].cwiseProduct(s.spin[i]).dot(s.spin[i]);
      const Vector3d strain = strainOf(m, s, strand, i);
      sum += 0.5 * m.length[i] * Vector3d(c.shear, c.shear, c.stretch).cwiseProduct(strain).dot(strain);
    }
  }
  Scratch frames(m);
  aim(m, s.time, frames);
  for (const Strand& strand : m.strands) {
    const Section& c = strand.section;
    for (Index k = strand.joints_begin; k < strand.joints_end; ++k) {
      const Vector3d off = bendOf(m, s, frames.held_frame, k) / m.joints[k].length - s.natural_curvature[k];
      sum += 0.5 * m.joints[k].length * Vector3d(c.bend, c.bend, c.twist).cwiseProduct(off).dot(off);
    }
  }
  return sum;
}

}  // namespace vest::suture
