#include <algorithm>
#include <cmath>
#include <utility>

#include "contacts.h"

namespace vest::suture {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr int kMostSweeps = 100;         ///< of a pass; the next one goes on from its forces
constexpr double kEnd = 3e-5;            ///< of the greatest force: a smaller change in a sweep ends them
constexpr double kEndOfSolution = 3e-4;  ///< the same after a solution: what changes then is all that is left
constexpr std::size_t kMostUnknowns = 120;  ///< of an active set
constexpr double kMostSticking =
    1.7;                        ///< unknowns a row that presses (tuned): where more stick, sweeps are faster
constexpr int kMostSteps = 12;  ///< of a solution
constexpr double kRim = 1e-7;   ///< of the greatest friction: nearer to it a row slides
constexpr double kNothing = 1e-12;  ///< N: a load that is none

/// Numbers in a column of the coupling: pairs.
std::size_t lengthOf(std::size_t rows) {
  return 3 * rows + (rows % 2);
}

/// The block of rows r and q: its columns are in those of q.
double* block(ContactScratch& c, std::size_t r, std::size_t q) {
  return c.coupling.data() + 3 * q * lengthOf(c.rows.size()) + 3 * r;
}
}  // namespace

void couple(ContactScratch& c) {
  const std::size_t n = c.rows.size(), nodes = c.touched.size(), length = lengthOf(n);
  for (std::size_t r = 0; r < n; ++r) {
    const Row& row = c.rows[r];
    for (std::size_t q = r; q < n; ++q) {
      const Row& other = c.rows[q];
      Matrix3d sum = Matrix3d::Zero();
      for (std::size_t i = 0; i < 4; ++i) {
        if (row.node[i] == kNone) continue;
        Matrix3d part = Matrix3d::Zero();
        const Matrix3d* answers = &c.answers[c.place[row.node[i]] * nodes];
        for (std::size_t j = 0; j < 4; ++j)
          if (other.node[j] != kNone) part += other.weight[j] * answers[c.place[other.node[j]]];
        sum += row.weight[i] * part;
      }
      const Matrix3d both = row.axes.transpose() * sum * other.axes;
      double *there = block(c, r, q), *back = block(c, q, r);
      for (std::size_t j = 0; j < 3; ++j)
        for (std::size_t i = 0; i < 3; ++i)
          there[j * length + i] = back[i * length + j] = both(static_cast<int>(i), static_cast<int>(j));
    }
    if (n % 2 == 1)
      for (std::size_t j = 0; j < 3; ++j) block(c, n, r)[j * length] = 0.0;
    Own& own = c.own[r];
    for (std::size_t j = 0; j < 3; ++j)
      for (std::size_t i = 0; i < 3; ++i)
        own.D(static_cast<int>(i), static_cast<int>(j)) = block(c, r, r)[j * length + i];
    own.inverse = own.D.inverse();
    own.trace = 1.0 / (own.D(1, 1) + own.D(2, 2));
  }
}

namespace {

/// What a change of the force of row r does to all gaps.
void addGaps(ContactScratch& c, std::size_t r, const Vector3d& force) {
  const std::size_t length = lengthOf(c.rows.size());
  double* gaps = c.gaps.data();
  const double *x = block(c, 0, r), *y = x + length, *z = y + length;
  for (std::size_t i = 0; i < length; ++i) gaps[i] += (x[i] * force[0] + y[i] * force[1]) + z[i] * force[2];
}

/// Coulomb's law for one row whose gap without its own force is g.
Vector3d law(const Own& own, const Vector3d& g, const Friction& friction, Vector3d force) {
  const Vector3d still = -(own.inverse * g);
  if (still[0] > 0.0) {
    const double mu = coefficient(friction, still[0]);
    if (still[1] * still[1] + still[2] * still[2] <= mu * mu * still[0] * still[0]) return still;
  }
  force[0] = std::max(0.0, -(g[0] + own.D(0, 1) * force[1] + own.D(0, 2) * force[2]) / own.D(0, 0));
  const double most = coefficient(friction, force[0]) * force[0];
  if (most == 0.0) return {force[0], 0.0, 0.0};
  const double g1 = g[1] + own.D(1, 0) * force[0], g2 = g[2] + own.D(2, 0) * force[0];
  for (int i = 0; i < 2; ++i) {  // projected; the sweeps go on
    const double d1 = g1 + own.D(1, 1) * force[1] + own.D(1, 2) * force[2],
                 d2 = g2 + own.D(2, 1) * force[1] + own.D(2, 2) * force[2];
    force[1] -= d1 * own.trace, force[2] -= d2 * own.trace;
    const double squared = force[1] * force[1] + force[2] * force[2];
    if (squared > most * most) {
      const double share = most / std::sqrt(squared);
      force[1] *= share, force[2] *= share;
    }
  }
  return force;
}

/// One sweep of Gauss–Seidel over the rows. @return squares of the greatest change and of the greatest force
std::pair<double, double> sweep(ContactScratch& c) {
  double change = 0.0, greatest = 0.0;
  for (std::size_t r = 0; r < c.rows.size(); ++r) {
    Row& row = c.rows[r];
    const Vector3d g(c.gaps[3 * r], c.gaps[3 * r + 1], c.gaps[3 * r + 2]);
    if (row.force[0] == 0.0 && g[0] >= 0.0) continue;  // open, and stays so
    const Own& own = c.own[r];
    const Vector3d force = law(own, g - own.D * row.force, c.near[row.near].friction, row.force),
                   by = force - row.force;
    change = std::max(change, by.squaredNorm());
    greatest = std::max(greatest, force.squaredNorm());
    row.force = force;
    if (by != Vector3d::Zero()) addGaps(c, r, by);
  }
  return {change, greatest};
}

/// Onto what Coulomb's law allows, straight.
Vector3d withinCone(Vector3d force, const Friction& friction) {
  force[0] = std::max(0.0, force[0]);
  const double most = coefficient(friction, force[0]) * force[0],
               size = std::sqrt(force.tail<2>().squaredNorm());
  if (size > most) force.tail<2>() *= most / size;
  return force;
}

/// The active set, of rows that press. A row that sticks has its force as unknowns, one that slides its load,
/// with which its friction grows the way it points. @return whether there are any, and most rows slide
bool findActiveSet(ContactScratch& c) {
  c.unknowns.clear();
  std::size_t pressing = 0;
  for (std::size_t r = 0; r < c.rows.size(); ++r) {
    const Vector3d& force = c.rows[r].force;
    if (force[0] <= 0.0) continue;
    ++pressing;
    if (c.unknowns.size() + 3 > kMostUnknowns) return false;
    const Friction& friction = c.near[c.rows[r].near].friction;
    const double most = coefficient(friction, force[0]) * force[0], size = force.tail<2>().norm();
    const auto row = static_cast<Index>(r);
    if (size < (1.0 - kRim) * most) {
      for (Index e = 0; e < 3; ++e) c.unknowns.push_back({row, e, true, Vector3d::Unit(static_cast<int>(e))});
    } else {
      const double more = 1e-6 * force[0],
                   grows = (coefficient(friction, force[0] + more) * (force[0] + more) - most) / more;
      Vector3d along = Vector3d::UnitX();
      if (size > 0.0) along.tail<2>() = force.tail<2>() * (grows / size);  // else it slides without friction
      c.unknowns.push_back({row, 0, false, along});
    }
  }
  return pressing > 0 &&
         static_cast<double>(c.unknowns.size()) <= kMostSticking * static_cast<double>(pressing);
}

/// Solves c.system·x = c.answer by elimination with pivots; x is in c.answer. False: it is singular. Not
/// Eigen's: its blocks go by the size of the cache, and the bits with them.
bool solveSystem(ContactScratch& c) {
  const std::size_t n = c.unknowns.size();
  double *a = c.system.data(), *b = c.answer.data();
  double greatest = 0.0;
  for (std::size_t k = 0; k < n * n; ++k) greatest = std::max(greatest, std::abs(a[k]));
  for (std::size_t k = 0; k < n; ++k) {
    double* pivots = a + k * n;
    std::size_t p = k;
    for (std::size_t i = k + 1; i < n; ++i)
      if (std::abs(pivots[i]) > std::abs(pivots[p])) p = i;
    if (!(std::abs(pivots[p]) > 1e-10 * greatest)) return false;
    if (p != k) {
      for (std::size_t j = k; j < n; ++j) std::swap(a[j * n + k], a[j * n + p]);
      std::swap(b[k], b[p]);
    }
    const double inverse = 1.0 / pivots[k];
    for (std::size_t i = k + 1; i < n; ++i) pivots[i] *= inverse;
    const auto drop = [&](double* column, double by) {
      if (by == 0.0) return;
      for (std::size_t i = k + 1; i < n; ++i) column[i] -= by * pivots[i];
    };
    for (std::size_t j = k + 1; j < n; ++j) drop(a + j * n, a[j * n + k]);
    drop(b, b[k]);
  }
  for (std::size_t k = n; k-- > 0;) {
    b[k] /= a[k * n + k];
    for (std::size_t i = 0; i < k; ++i) b[i] -= a[k * n + i] * b[k];
  }
  return true;
}

/// How much of the way a row that sticks may go: to the rim of its cone, at the coefficient of its load.
double shareToRim(const Vector3d& force, double coefficient, const double* by) {
  const double most = coefficient * force[0], grows = coefficient * by[0];
  const double a = by[1] * by[1] + by[2] * by[2] - grows * grows,
               b = force[1] * by[1] + force[2] * by[2] - most * grows,
               d = force[1] * force[1] + force[2] * force[2] - most * most;
  if (!(d < 0.0) || a + 2.0 * b + d <= 0.0) return 1.0;  // it stays inside
  return -d / (b + std::sqrt(b * b - a * d));
}

enum class ActiveStep : std::uint8_t { Full, Stopped, Singular };

/// Towards the forces that close all gaps and leave what sticks where it is, where each row goes on as it
/// does. It stops where the first row lets go, or begins to slide.
ActiveStep activeSetStep(ContactScratch& c) {
  const std::size_t n = c.unknowns.size(), length = lengthOf(c.rows.size());
  for (std::size_t k = 0; k < n; ++k) {
    const Unknown& unknown = c.unknowns[k];
    const double* columns = block(c, 0, unknown.row);
    double* to = c.system.data() + k * n;
    for (std::size_t i = 0; i < n; ++i) {
      const double* at = columns + 3 * c.unknowns[i].row + c.unknowns[i].axis;
      to[i] = (at[0] * unknown.along[0] + at[length] * unknown.along[1]) + at[2 * length] * unknown.along[2];
    }
    c.answer[k] = -c.gaps[3 * unknown.row + unknown.axis];
  }
  if (!solveSystem(c)) return ActiveStep::Singular;
  double share = 1.0;
  for (std::size_t k = 0; k < n; ++k) {
    if (c.unknowns[k].axis != 0) continue;
    const Row& row = c.rows[c.unknowns[k].row];
    if (row.force[0] + c.answer[k] < 0.0) share = std::min(share, -row.force[0] / c.answer[k]);
    if (c.unknowns[k].sticks)
      share = std::min(
          share, shareToRim(row.force, coefficient(c.near[row.near].friction, row.force[0]), &c.answer[k]));
  }
  for (std::size_t k = 0; k < n; k += c.unknowns[k].sticks ? 3 : 1) {
    Row& row = c.rows[c.unknowns[k].row];
    const Friction& friction = c.near[row.near].friction;
    Vector3d force = row.force;
    force[0] = std::max(0.0, force[0] + share * c.answer[k]);
    if (force[0] < kNothing) force[0] = 0.0;
    if (c.unknowns[k].sticks) {
      force[1] += share * c.answer[k + 1], force[2] += share * c.answer[k + 2];
      force = withinCone(force, friction);
    } else if (const double size = row.force.tail<2>().norm(); size > 0.0) {
      force.tail<2>() *= coefficient(friction, force[0]) * force[0] / size;
    }
    const Vector3d by = force - row.force;
    row.force = force;
    if (by != Vector3d::Zero()) addGaps(c, c.unknowns[k].row, by);
  }
  return share == 1.0 ? ActiveStep::Full : ActiveStep::Stopped;
}

/// Where sweeps would come to, if nothing else lets go, touches or slides; they judge it. Steps as of Lawson
/// and Hanson (1974, Solving Least Squares Problems, 23), with cones. @return whether forces have changed
bool solveActiveSet(ContactScratch& c) {
  bool any = false;
  for (int k = 0; k < kMostSteps && findActiveSet(c); ++k) {
    const ActiveStep done = activeSetStep(c);
    if (done == ActiveStep::Singular) break;
    any = true;
    if (done == ActiveStep::Full) break;
  }
  return any;
}

}  // namespace

void makeRoomForForces(ContactScratch& c) {
  c.coupling.resize(3 * c.room * lengthOf(c.room));
  c.gaps.resize(lengthOf(c.room));
  c.gaps_before.resize(lengthOf(c.room));
  c.own.resize(c.room);
  c.unknowns.reserve(kMostUnknowns);
  c.system.resize(kMostUnknowns * kMostUnknowns);
  c.answer.resize(kMostUnknowns);
}

void findForces(ContactScratch& c, Scratch& scratch) {
  for (std::size_t r = 0; r < c.rows.size(); ++r)
    for (std::size_t e = 0; e < 3; ++e) c.gaps[3 * r + e] = c.rows[r].gap[static_cast<int>(e)];
  if (c.rows.size() % 2 == 1) c.gaps[3 * c.rows.size()] = 0.0;
  for (std::size_t r = 0; r < c.rows.size(); ++r)
    if (c.rows[r].force[0] > 0.0) addGaps(c, r, c.rows[r].force);
  for (Row& row : c.rows) row.last = row.force;
  double momentum = 1.0, was = 0.0;  // squares, as all changes here
  int since = 0;                     // sweeps after the last solution
  bool solved = false, solves = true;
  for (int k = 1;; ++k) {
    ++scratch.sweeps, ++since;
    const auto [change, greatest] = sweep(c);
    scratch.contact_residual = std::sqrt(change);
    const double end = solved ? kEndOfSolution : kEnd;
    if (change <= end * end * greatest) break;
    const bool away = solved && change > 2.0 * was;
    solved = false;
    if (away) {  // from the solution: back to where the active set was solved
      for (Row& row : c.rows) row.force = row.last;
      std::copy(c.gaps_before.begin(), c.gaps_before.end(), c.gaps.begin());
      solves = false, momentum = 1.0;
    }
    if (k >= kMostSweeps) break;
    if (away) continue;
    if (solves && since >= 2 && change > 0.25 * was && findActiveSet(c)) {
      for (Row& row : c.rows) row.last = row.force;
      std::copy(c.gaps.begin(), c.gaps.end(), c.gaps_before.begin());
      solved = solves = solveActiveSet(c);
      was = change, momentum = 1.0, since = 0;
      if (solved) continue;
    }
    const double next = 0.5 * (1.0 + std::sqrt(1.0 + 4.0 * momentum * momentum)),
                 share = change > was ? 0.0 : (momentum - 1.0) / next;
    momentum = change > was ? 1.0 : next;
    was = change;
    for (std::size_t r = 0; r < c.rows.size(); ++r) {
      Row& row = c.rows[r];
      const Vector3d swept = row.force, by = swept - row.last;
      row.last = swept;
      if (share == 0.0 || by == Vector3d::Zero()) continue;
      row.force = withinCone(swept + share * by, c.near[row.near].friction);
      addGaps(c, r, row.force - swept);
    }
  }
}

}  // namespace vest::suture
