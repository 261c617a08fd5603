#include "vest_tissue/interaction/sling_loop.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>

#include "vest_tissue/base/elementary.h"

namespace vest::interaction {
namespace {

using Eigen::Vector3d;

constexpr int kN = kSlingNodes;
constexpr int kFree = kN - 1;  // all but the central knot
constexpr int kBand = 4;       // below the diagonal, in the order of slotOf()
constexpr double kPi = 3.141592653589793;
constexpr double kOpenLink = kSlingLength / kN;                             // m
constexpr double kSection = kPi * kSlingRadius * kSlingRadius;              // m²
constexpr double kNodeMass = kSlingDensity * kSection * kOpenLink;          // kg
constexpr double kInertia = 0.25 * kSection * kSlingRadius * kSlingRadius;  // m^4, second moment of area
constexpr double kBending = kSlingModulus * kInertia / (kOpenLink * kOpenLink * kOpenLink);  // N/m
/// 1/s: what the open loop's slowest motion, of the order of sqrt(EI/µ)/R², is damped with: twice that,
/// critically (assumed). sqrt(EI/µ) = 0.107 m²/s, R = 19.1 mm.
constexpr double kDamping = 600.0;
constexpr int kRounds = 24;         // of links and planes in turn, at most (tuned)
constexpr double kExact = 1e-4;     // of a link's length: links and planes agree (tuned)
constexpr double kSoft = 1e-6;      // of a link's inverse mass: keeps a straight chain solvable (tuned)
constexpr double kShortest = 1e-9;  // m

/// Row of a node: from the knot outward on both sides in turn, so that neighbours are at most kBand rows
/// apart although the chain is closed.
constexpr int slotOf(int node) {
  return node <= kN / 2 ? 2 * (node - 1) : 2 * (kN - node) - 1;
}
static_assert(slotOf(1) == 0 && slotOf(kN - 1) == 1 && slotOf(2) == 2 && slotOf(kN / 2) == kFree - 1);

using Band = std::array<std::array<double, kBand + 1>, kFree>;  // [row][row - column]

/// L D L^T in place: D on the diagonal, L below.
void factorBand(Band& a) {
  for (int r = 0; r < kFree; ++r) {
    for (int d = std::min(kBand, r); d >= 0; --d) {
      const int col = r - d;
      double sum = a[r][d];
      for (int e = d + 1; e <= std::min(kBand, r); ++e) {
        const int other = r - e;  // column left of col
        if (col - other <= kBand) sum -= a[r][e] * a[other][0] * a[col][col - other];
      }
      a[r][d] = d == 0 ? sum : sum / a[col][0];
    }
  }
}

void solveBand(const Band& a, std::array<Vector3d, kFree>& b) {
  for (int r = 0; r < kFree; ++r)
    for (int d = 1; d <= std::min(kBand, r); ++d) b[r] -= a[r][d] * b[r - d];
  for (int r = 0; r < kFree; ++r) b[r] /= a[r][0];
  for (int r = kFree - 1; r >= 0; --r)
    for (int d = 1; d <= std::min(kBand, r); ++d) b[r - d] -= a[r][d] * b[r];
}

/// One Newton step on the lengths of all links; the central knot does not move. Link i goes from node i to
/// i+1, so that links i and i+1 share node i+1: tridiagonal, since the first and the last share only the
/// knot. Returns the greatest error of a length before it, m.
double straighten(std::array<Vector3d, kN>& x, double length) {
  std::array<Vector3d, kN> u;
  std::array<double, kN> diagonal, below, lambda;
  const auto moves = [](int node) { return node % kN == 0 ? 0.0 : 1.0; };
  for (int i = 0; i < kN; ++i) {
    const Vector3d d = x[(i + 1) % kN] - x[i];
    const double l = std::sqrt(d.squaredNorm());
    u[i] = l > kShortest ? Vector3d(d / l) : Vector3d(Vector3d::Zero());
    lambda[i] = l - length;
    diagonal[i] = moves(i) + moves(i + 1) + kSoft;
    below[i] = i == 0 ? 0.0 : -moves(i) * u[i - 1].dot(u[i]);
  }
  double worst = 0.0;
  for (const double error : lambda) worst = std::max(worst, std::fabs(error));
  for (int i = 1; i < kN; ++i) {
    const double f = below[i] / diagonal[i - 1];
    diagonal[i] -= f * below[i];
    lambda[i] -= f * lambda[i - 1];
  }
  for (int i = kN - 1; i >= 0; --i) {
    if (i + 1 < kN) lambda[i] -= below[i + 1] * lambda[i + 1];
    lambda[i] /= diagonal[i];
  }
  for (int i = 1; i < kN; ++i) {
    Vector3d move = lambda[i] * u[i] - lambda[i - 1] * u[i - 1];
    // A Newton step from far away goes no further than a link.
    const double way = std::sqrt(move.squaredNorm());
    if (way > length) move *= length / way;
    x[i] += move;
  }
  return worst;
}

void keepOut(std::array<LoopPlane, kN>& planes, std::array<Vector3d, kN>& x) {
  for (int i = 1; i < kN; ++i) {
    LoopPlane& p = planes[i];
    const double deep = p.offset - p.normal.dot(x[i]);
    if (!p.active || !(deep > 0.0)) continue;
    x[i] += deep * p.normal;
    p.pushed += deep;
  }
}

/// Friction across the thread. It is held by what pushed it in this step, and by the tension that presses it
/// on: the way that its friction takes from the node's inertia.
void stick(const Sling& s, const LoopStep& step, std::array<Vector3d, kN>& x) {
  for (int i = 1; i < kN; ++i) {
    const LoopPlane& p = step.planes[i];
    if (!s.touch[i].on || !p.active) continue;
    const Vector3d along = x[(i + 1) % kN] - x[i - 1];
    Vector3d across = p.normal.cross(along);
    const double wide = std::sqrt(across.squaredNorm());
    if (!(wide > kShortest)) continue;
    across /= wide;
    const Vector3d ahead = x[(i + 1) % kN] - x[i], behind = x[i] - x[i - 1];
    const double a = std::sqrt(ahead.squaredNorm()), b = std::sqrt(behind.squaredNorm());
    const double turn =
        a > kShortest && b > kShortest ? std::sqrt((ahead / a - behind / b).squaredNorm()) : 0.0;
    const double most = p.friction * (p.pushed + s.tension * turn * step.h * step.h / kNodeMass);
    const double slip = across.dot(x[i] - step.start[i]);
    x[i] -= std::clamp(slip, -most, most) * across;
  }
}

}  // namespace

Vector3d hangingNode(const Sling& s, double length, int node) {
  const double radius = 0.5 * length / kN / base::sineOfTurns(0.5 / kN);
  const double turns = static_cast<double>(node) / kN;
  return s.tip +
         radius * ((1.0 - base::sineOfTurns(turns + 0.25)) * s.ahead + base::sineOfTurns(turns) * s.across);
}

void swing(const Sling& s, const LoopStep& step, std::array<Vector3d, kN>& to) {
  const double inertia = kNodeMass / (step.h * step.h), damping = kNodeMass * kDamping / step.h;
  Band a{};
  for (int r = 0; r < kFree; ++r) a[r][0] = inertia + damping;
  constexpr double kSecond[3] = {1.0, -2.0, 1.0};
  for (int i = 0; i < kN; ++i) {
    for (int p = 0; p < 3; ++p) {
      for (int q = 0; q < 3; ++q) {
        const int m = (i + p - 1 + kN) % kN, n = (i + q - 1 + kN) % kN;
        if (m == 0 || n == 0 || slotOf(m) < slotOf(n)) continue;
        a[slotOf(m)][slotOf(m) - slotOf(n)] += kBending * kSecond[p] * kSecond[q];
      }
    }
  }
  factorBand(a);
  std::array<Vector3d, kFree> b;
  for (int i = 1; i < kN; ++i) {
    const Vector3d free = s.touch[i].on ? step.start[i] : Vector3d(step.start[i] + step.h * s.velocity[i]);
    b[slotOf(i)] = inertia * (free - hangingNode(s, s.rest, i)) +
                   damping * (s.node[i] - step.hanging_before[i]) + kNodeMass * step.gravity;
  }
  solveBand(a, b);
  to[0] = s.tip;
  for (int i = 1; i < kN; ++i) to[i] = hangingNode(s, s.rest, i) + b[slotOf(i)];
}

void link(const Sling& s, LoopStep& step, std::array<Vector3d, kN>& x) {
  const double length = s.rest / kN;
  for (LoopPlane& p : step.planes) p.pushed = 0.0;
  keepOut(step.planes, x);
  for (int round = 0; round < kRounds; ++round) {
    const double worst = straighten(x, length);
    keepOut(step.planes, x);
    if (worst < kExact * length) break;
  }
  stick(s, step, x);
}

}  // namespace vest::interaction
