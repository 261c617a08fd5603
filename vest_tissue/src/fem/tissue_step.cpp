#include <algorithm>
#include <cmath>

#include "tissue_solve.h"
#include "vest_tissue/fem/cut_factor.h"

namespace vest::fem {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr int kSweeps = 40;         ///< of Gauss-Seidel over the points (tuned)
constexpr double kOvershoot = 4.0;  ///< no unit; tuned
constexpr double kPushOut = 2.0;    ///< m/s: of what a tool that appears in tissue holds within (tuned)
constexpr double kStiffer = 4.0;    ///< stiffness of a contact over that of the tissue in this step (tuned)
constexpr int kThreadPasses = 2;    ///< of correctThreads() (tuned)
constexpr double kSettled = 1e-7;   ///< relative change of forces at which the sweeps end

/// u += K^-1 f of a condensed object; `force`: N per knot.
template <class Force>
void follow(const TissueModel& t, const TissueState& s, Force force, TissueScratch& w) {
  w.loads.clear();
  for (std::size_t k = 0; k < s.x.size(); ++k) {
    const std::int32_t row = t.answer_number[k];
    if (row < 0) continue;
    const Eigen::Vector3f f = force(k);
    if (f != Eigen::Vector3f::Zero()) w.loads.push_back({static_cast<std::uint32_t>(row), f});
  }
  std::sort(w.loads.begin(), w.loads.end(), [](const auto& a, const auto& b) { return a.node < b.node; });
  if (!w.loads.empty()) t.compliance.add(w.loads, 1.0 / s.stiffness_scale, w.u);
}

}  // namespace

void tissueForces(const TissueModel& t, const TissueState& s, TissueScratch& w) {
  const Model& m = *t.model;
  std::fill_n(w.force.begin(), s.x.size(), Vector3d::Zero());
  const bool turning = corotational(t);
  for (std::size_t e = 0; e < m.elements.size(); ++e) {
    const Matrix3d F = gradient(m.elements[e], s.corner[e], s.x);
    if (turning) {
      w.rotation[e] = polarRotation(F);
      const Matrix3d A = w.rotation[e].transpose() * F - (1.0 - shrinkOf(s, e)) * Matrix3d::Identity();
      scatter(m.elements[e], m.laws[e], w.rotation[e], A, scaleOf(s, e), s.corner[e], w.force);
    } else {
      const Matrix3d A = F - (1.0 - shrinkOf(s, e)) * Matrix3d::Identity();
      scatter(m.elements[e], m.laws[e], Matrix3d::Identity(), A, scaleOf(s, e), s.corner[e], w.force);
    }
  }
}

bool freeTissueStep(const TissueModel& t, const TissueState& s, double h,
                    const std::array<const float*, 3>& held, const Vector3d& gravity, TissueScratch& w) {
  const Model& m = *t.model;
  const std::size_t n = s.x.size();
  if (!s.factored) {
    w.u = t.under_loads;
    for (int axis = 0; axis < 3; ++axis)
      w.u += gravity[axis] * t.unit_gravity[static_cast<std::size_t>(axis)];
    w.u /= s.stiffness_scale;
    const auto at = [&](std::size_t k) { return Eigen::Vector3f(held[0][k], held[1][k], held[2][k]); };
    if (t.condensed()) follow(t, s, at, w);
    for (std::size_t k = 0; k < n && !t.condensed(); ++k) {
      const std::int32_t row = t.answer_number[k];
      if (row < 0) continue;
      for (int axis = 0; axis < 3; ++axis) {
        const double f = held[static_cast<std::size_t>(axis)][k];
        if (f != 0.0) w.u += (f / s.stiffness_scale) * t.answer.col(3 * row + axis);
      }
    }
    for (std::size_t k = 0; k < n; ++k) {
      const std::int32_t row = t.answer_number[k];
      w.q[k] = row < 0 ? s.x[k] : Vector3d(m.description.nodes[k] + w.u.segment<3>(3 * row));
    }
    return w.u.allFinite();
  }
  const double a = m.description.material.rayleigh_mass, b = m.description.material.rayleigh_stiffness;
  const bool elastostatic = t.motion == Motion::Elastostatic;
  if (elastostatic) w.cut->renew(t, s);
  tissueForces(t, s, w);
  // What is in equilibrium has no past: it begins at rest.
  for (std::size_t k = 0; k < n; ++k) {
    if (isFree(t, s, k) && !still(t, w, k))
      w.v_next[k] = s.v[k];
    else
      w.v_next[k].setZero();
  }
  minusStiffnessTimes(t, s, w, w.v_next, w.q);
  bool finite = true;
  for (std::size_t k = 0; k < n; ++k) {
    if (!isFree(t, s, k)) {
      w.r[k].setZero();
      continue;
    }
    Vector3d f(held[0][k], held[1][k], held[2][k]);
    if (elastostatic) f += s.mass[k] * gravity;
    const Index o = s.origin[k];
    f += (s.mass[k] / m.mass[o]) * m.load[o];  // halves of a load go with the halves of the mass
    w.r[k] = h * (f + w.force[k] - (a * s.mass[k]) * w.v_next[k] + (h + b) * w.q[k]);
    finite = finite && w.r[k].allFinite();
  }
  if (!finite) return false;
  if (!w.groups.empty()) {
    if (elastostatic) findTurning(s, gravity, w);
    // Begin with velocities that bring the groups to their shapes.
    for (std::size_t k = 0; k < n; ++k) w.p[k] = -w.v_next[k];
    makeRigid(w.groups, w.v_next);
    for (const TissueGroup& g : w.groups)
      for (int i = 0; i < g.count; ++i) w.v_next[g.knots[i]] += (g.goal[i] - s.x[g.knots[i]]) / h;
    for (std::size_t k = 0; k < n; ++k) w.p[k] += w.v_next[k];
    matrixTimes(t, s, h, w, w.p, w.q);
    for (std::size_t k = 0; k < n; ++k) w.r[k] -= w.q[k];
    for (TissueGroup& g : w.groups) g.impulse.fill(Vector3d::Zero());
  }
  solve(t, s, h, w);
  addImpulses(w);
  for (std::size_t k = 0; k < n; ++k) w.q[k] = s.x[k] + h * w.v_next[k];
  return true;
}

namespace {

/// The answers between points are approximate where elements turn, are denatured or clipped:
/// threads are solved anew from where their points really end, so that links pull along themselves.
void correctThreads(const TissueModel& t, const TissueState& s, double h, TissueScratch& w,
                    const Vector3d* start, Vector3d* end) {
  if (w.threads.empty() || (w.groups.empty() && exact(t, s, w, h) && !divided(t, s))) return;
  std::array<Vector3d, kMostThreadPoints> before;
  for (int pass = 0; pass < kThreadPasses; ++pass) {
    std::fill_n(w.r.begin(), s.x.size(), Vector3d::Zero());
    for (TissueThread& thread : w.threads) {
      const std::size_t first = thread.first, points = static_cast<std::size_t>(thread.count);
      for (std::size_t p = 0; p < points; ++p) {
        TissuePoint& point = w.points[first + p];
        end[first + p].setZero();
        for (int a = 0; a < point.used(); ++a) {
          if (point.weights[a] == 0.0) continue;
          const Index k = point.knots[a];
          end[first + p] += point.weights[a] * (s.x[k] + h * w.v_next[k]);
        }
        before[p] = point.force;
      }
      for (std::size_t p = 0; p < points; ++p)
        for (std::size_t q = 0; q < points; ++q)
          end[first + p] -= w.answers[(first + p) * kMostTissuePoints + first + q] * before[q];
      for (std::size_t p = 0; p < points; ++p) w.points[first + p].force.setZero();
      solveThread(w, thread, h, start, end);
      for (std::size_t p = 0; p < points; ++p) {
        const TissuePoint& point = w.points[first + p];
        for (int a = 0; a < point.used(); ++a)
          if (point.weights[a] != 0.0)
            w.r[point.knots[a]] += (h * point.weights[a]) * (point.force - before[p]);
      }
    }
    solve(t, s, h, w);
    addImpulses(w);
  }
}

}  // namespace

void solveTissuePoints(const TissueModel& t, const TissueState& s, double h, TissueScratch& w) {
  const std::size_t count = w.points.size();
  if (count == 0) return;
  answerPoints(t, s, h, w);
  const auto D = [&](std::size_t p, std::size_t q) -> Matrix3d& {
    return w.answers[p * kMostTissuePoints + q];
  };
  // Where the points are at the end without these forces; then with them.
  double longest = 0.0;  // m: of the ways that the forces are there for
  std::array<Vector3d, kMostTissuePoints> start, end;
  for (std::size_t p = 0; p < count; ++p) {
    start[p].setZero(), end[p].setZero();
    TissuePoint& point = w.points[p];
    for (int a = 0; a < point.used(); ++a) {
      if (point.weights[a] == 0.0) continue;
      start[p] += point.weights[a] * s.x[point.knots[a]];
      end[p] += point.weights[a] * w.q[point.knots[a]];
    }
    point.force.setZero();
  }
  for (TissueThread& thread : w.threads) {
    std::array<Vector3d, kMostThreadPoints> slack;
    const std::size_t first = thread.first, points = static_cast<std::size_t>(thread.count);
    for (std::size_t p = 0; p < points; ++p) slack[p] = end[first + p];
    solveThread(w, thread, h, start.data(), end.data());
    for (std::size_t p = 0; p < points; ++p) longest = std::max(longest, (end[first + p] - slack[p]).norm());
  }
  for (std::size_t p = 0; p < count; ++p) {
    TissuePoint& point = w.points[p];
    const Matrix3d& own = D(p, p);
    point.compliance = point.kind == 0 ? point.normal.dot(own * point.normal) : own.trace() / 3.0;
    const Vector3d slip = end[p] - start[p] - h * point.target_velocity;
    if (point.kind == 2) continue;
    if (point.kind == 1) {
      longest = std::max(longest, (point.target - end[p]).norm());
      continue;
    }
    // What lies deeper in the tool than they came together in this step was there before: it is pushed out by
    // and by, not thrown.
    const double way = slip.norm(), deep = point.reach - point.normal.dot(point.target - end[p]);
    const double most = way + kPushOut * h;
    if (deep > most) point.reach -= deep - most;
    longest = std::max(longest, way + std::clamp(deep, 0.0, most));
  }
  for (int sweep = 0; sweep < kSweeps; ++sweep) {
    double change = 0.0, size = 0.0;
    for (std::size_t p = 0; p < count; ++p) {
      TissuePoint& point = w.points[p];
      if (point.kind == 2) continue;
      // All that hold one knot are solved at once: one by one they would hand the load to and fro.
      if (point.led) continue;
      const auto next = [&w](const TissuePoint& of) {
        return of.with < 0 ? nullptr : &w.points[static_cast<std::size_t>(of.with)];
      };
      const Matrix3d& own = D(p, p);
      Vector3d before = point.force;
      for (TissuePoint* o = next(point); o != nullptr; o = next(*o)) before += o->force;
      const Vector3d without = end[p] - own * before;
      Vector3d force;
      if (point.kind == 1) {
        const auto hardness = [h](const TissuePoint& of) { return of.stiffness + of.damping / h; };
        // F = k (target - x) + c (target' - x'), x = without + own F
        const auto wanted = [&](const TissuePoint& of) {
          return Vector3d(of.stiffness * (of.target - without) +
                          of.damping * (of.target_velocity - (without - start[p]) / h));
        };
        double k = hardness(point);
        Vector3d all = wanted(point);
        for (TissuePoint* o = next(point); o != nullptr; o = next(*o)) k += hardness(*o), all += wanted(*o);
        const Matrix3d A = Matrix3d::Identity() + k * own;
        Matrix3d inverse;
        bool good = false;
        A.computeInverseWithCheck(inverse, good, 0.0);
        force = good ? Vector3d(inverse * all) : Vector3d(Vector3d::Zero());
        for (TissuePoint* o = next(point); o != nullptr; o = next(*o))
          o->force = wanted(*o) - hardness(*o) * (own * force);
      } else {
        const double n_own = point.compliance;
        // Much stiffer than the tissue behind it, as far as the tool bears it.
        const double k = n_own > 0.0 ? std::clamp(kStiffer / n_own, point.stiffness, point.most_stiffness)
                                     : point.stiffness;
        const double gap = point.normal.dot(point.target - without) - point.reach;
        const double push = std::max(0.0, -k * gap / (1.0 + k * n_own));
        force = -push * point.normal;
        if (push > 0.0 && point.friction > 0.0) {
          // Sticking force that brings the slip of this step to zero, within Coulomb's disc.
          const Vector3d slip = (without + own * force - start[p]) - h * point.target_velocity;
          const Vector3d tangential = slip - point.normal.dot(slip) * point.normal;
          const double soft = 0.5 * std::max(own.trace() - n_own, 0.0);
          const double length = std::sqrt(tangential.squaredNorm());
          // A held knot does not give: friction there cannot act within a step.
          if (soft > 1e-30 && length > 0.0) {
            const double stick = length / soft, most = point.friction * push;
            force -= (std::min(stick, most) / length) * tangential;
          }
        }
      }
      const Vector3d delta = force - before;
      point.force = force;
      for (TissuePoint* o = next(point); o != nullptr; o = next(*o)) point.force -= o->force;
      if (delta.squaredNorm() == 0.0) continue;
      for (std::size_t q = 0; q < count; ++q) end[q] += D(p, q).transpose() * delta;  // symmetric
      change += delta.squaredNorm();
      size += force.squaredNorm();
    }
    if (change <= kSettled * kSettled * size) break;
  }
  for (std::size_t p = 0; p < count; ++p) {
    TissuePoint& point = w.points[p];
    if (point.kind == 0 && point.compliance > 0.0)
      point.stiffness = std::clamp(kStiffer / point.compliance, point.stiffness, point.most_stiffness);
    const Vector3d slide = (end[p] - start[p]) / h - point.target_velocity;
    if (point.kind == 1) {
      point.slip_power = point.damping * slide.squaredNorm();
    } else if (point.kind == 0) {
      const Vector3d tangential = point.force - point.normal.dot(point.force) * point.normal;
      point.slip_power = std::max(0.0, -tangential.dot(slide));
    }
  }
  if (t.condensed()) {
    std::fill_n(w.r.begin(), s.x.size(), Vector3d::Zero());
    for (const TissuePoint& point : w.points)
      for (int a = 0; a < point.used(); ++a)
        if (point.weights[a] != 0.0) w.r[point.knots[a]] += point.weights[a] * point.force;
    const auto at = [&](std::size_t k) { return Eigen::Vector3f(w.r[k].cast<float>()); };
    follow(t, s, at, w);
    return;
  }
  if (!s.factored) {
    for (const TissuePoint& point : w.points) {
      for (int a = 0; a < point.used(); ++a) {
        const std::int32_t row = point.weights[a] == 0.0 ? -1 : t.answer_number[point.knots[a]];
        if (row < 0) continue;
        for (int axis = 0; axis < 3; ++axis) {
          const double f = point.weights[a] * point.force[axis] / s.stiffness_scale;
          if (f != 0.0) w.u += f * t.answer.col(3 * row + axis);
        }
      }
    }
    return;
  }
  std::fill_n(w.r.begin(), s.x.size(), Vector3d::Zero());
  bool any = false;
  for (const TissuePoint& point : w.points) {
    for (int a = 0; a < point.used(); ++a) {
      if (point.weights[a] == 0.0) continue;
      w.r[point.knots[a]] += (h * point.weights[a]) * point.force;
      any = any || point.force.squaredNorm() > 0.0;
    }
  }
  if (!any) return;
  std::copy_n(w.v_next.begin(), s.x.size(), w.force.begin());  // m/s: without these forces
  solve(t, s, h, w);
  addImpulses(w);
  correctThreads(t, s, h, w, start.data(), end.data());
  // The sweeps may not settle where friction wedges thin flaps; answers are approximate where the
  // matrix of the cut mesh is singular to rounding; and a light knot that bears little of a place goes much
  // further than the place. Forces that throw any knot further than kOvershoot times the longest way that any
  // of them had to go are lowered, all alike. A tool that is elsewhere at once takes no crumb along.
  double furthest = 0.0;
  for (std::size_t k = 0; k < s.x.size(); ++k)
    furthest = std::max(furthest, (w.v_next[k] - w.force[k]).squaredNorm());
  const double is = h * std::sqrt(furthest), most = std::min(kOvershoot * longest, kSnapSpeed * h);
  const double keep = is > most ? most / is : 1.0;
  if (keep == 1.0) return;
  for (std::size_t k = 0; k < s.x.size(); ++k) w.v_next[k] = w.force[k] + keep * (w.v_next[k] - w.force[k]);
  for (TissuePoint& point : w.points) point.force *= keep, point.slip_power *= keep;
  for (TissueThread& thread : w.threads) thread.tension *= keep;
}

bool endTissueStep(const TissueModel& t, TissueState& s, double h, TissueScratch& w) {
  const std::size_t n = s.x.size();
  if (!s.factored) {
    if (!w.u.allFinite()) return false;
    double most = 0.0;
    for (std::size_t k = 0; k < n; ++k) {
      const std::int32_t row = t.answer_number[k];
      if (row < 0) continue;
      w.q[k] = t.model->description.nodes[k] + w.u.segment<3>(3 * row);
      most = std::max(most, (w.q[k] - s.x[k]).squaredNorm());
    }
    const double way = std::sqrt(most), part = way > kSnapSpeed * h ? kSnapSpeed * h / way : 1.0;
    for (std::size_t k = 0; k < n; ++k) {
      if (t.answer_number[k] < 0) continue;
      const Vector3d move = part * (w.q[k] - s.x[k]);
      s.v[k] = move / h;
      s.x[k] += move;
    }
    return true;
  }
  for (std::size_t k = 0; k < n; ++k)
    if (!w.v_next[k].allFinite()) return false;
  double most = 0.0;  // m²/s²: what follows at once does so no faster than kSnapSpeed
  if (t.motion == Motion::Elastostatic)
    for (std::size_t k = 0; k < n; ++k)
      if (still(t, w, k)) most = std::max(most, w.v_next[k].squaredNorm());
  const double fastest = std::sqrt(most), part = fastest > kSnapSpeed ? kSnapSpeed / fastest : 1.0;
  for (std::size_t k = 0; k < n; ++k) {
    if (!isFree(t, s, k)) continue;
    s.v[k] = still(t, w, k) ? Vector3d(part * w.v_next[k]) : w.v_next[k];
    s.x[k] += h * s.v[k];
  }
  return true;
}

}  // namespace vest::fem
