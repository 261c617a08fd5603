#include <algorithm>
#include <cmath>

#include "vest_tissue/fem/cut_factor.h"
#include "vest_tissue/fem/tissue.h"

namespace vest::fem {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kTolerance = 1e-7;  ///< of conjugate gradients, relative residual in the factor's norm
constexpr double kRounding = 1e-22;  ///< of the squared residual (tuned)
constexpr int kSweeps = 40;          ///< of Gauss-Seidel over the points (tuned)
constexpr double kOvershoot = 4.0;   ///< no unit; tuned
constexpr double kPushOut = 2.0;     ///< m/s: of what a tool that appears in tissue holds within (tuned)
constexpr double kStiffer = 4.0;     ///< stiffness of a contact over that of the tissue in this step (tuned)
constexpr int kThreadPasses = 2;     ///< of correctThreads() (tuned)
constexpr double kSettled = 1e-7;    ///< relative change of forces at which the sweeps end

inline bool corotational(const TissueModel& t) {
  return t.model->description.strain == Strain::Corotational;
}
inline bool isFree(const TissueModel& t, const TissueState& s, std::size_t knot) {
  return t.model->unknown[s.origin[knot]] >= 0;
}

/// Denatured collagen (docs/decisions/0020-…): shorter at rest, stiffer.
inline double shrinkOf(const TissueState& s, std::size_t e) {
  return s.denatured.empty() ? 0.0 : kShrinkage * static_cast<double>(s.denatured[e]);
}
inline double scaleOf(const TissueState& s, std::size_t e) {
  return s.denatured.empty() ? s.stiffness_scale
                             : s.stiffness_scale * (1.0 + kStiffening * static_cast<double>(s.denatured[e]));
}

inline Matrix3d gradient(const Element& e, const std::array<Index, 4>& c,
                         const std::vector<Vector3d>& field) {
  const Vector3d& x0 = field[c[0]];
  Matrix3d G = (field[c[1]] - x0) * e.gradient[1].transpose();
  G += (field[c[2]] - x0) * e.gradient[2].transpose();
  G += (field[c[3]] - x0) * e.gradient[3].transpose();
  return G;
}

/// out += corner forces of stress R·(2 mu e + lambda tr e), e = sym A.
inline void scatter(const Element& e, const Lame& law, const Matrix3d& R, const Matrix3d& A, double scale,
                    const std::array<Index, 4>& c, std::vector<Vector3d>& out) {
  Matrix3d stress = law.mu * (A + A.transpose());
  stress.diagonal().array() += law.lambda * A.trace();
  const Matrix3d P = (-e.volume * scale) * (R * stress);
  const Vector3d f1 = P * e.gradient[1], f2 = P * e.gradient[2], f3 = P * e.gradient[3];
  out[c[1]] += f1;
  out[c[2]] += f2;
  out[c[3]] += f3;
  out[c[0]] -= (f1 + f2) + f3;
}

/// out = -K_R v.
void minusStiffnessTimes(const TissueModel& t, const TissueState& s, const TissueScratch& w,
                         const std::vector<Vector3d>& v, std::vector<Vector3d>& out) {
  const Model& m = *t.model;
  std::fill_n(out.begin(), s.x.size(), Vector3d::Zero());
  const bool turning = corotational(t);
  for (std::size_t e = 0; e < m.elements.size(); ++e) {
    const Matrix3d G = gradient(m.elements[e], s.corner[e], v);
    if (turning) {
      scatter(m.elements[e], m.laws[e], w.rotation[e], w.rotation[e].transpose() * G, scaleOf(s, e),
              s.corner[e], out);
    } else {
      scatter(m.elements[e], m.laws[e], Matrix3d::Identity(), G, scaleOf(s, e), s.corner[e], out);
    }
  }
}

/// Whether the factor, of the mesh that is there, is that of the matrix itself.
bool exact(const TissueModel& t, const TissueState& s, double h) {
  return !corotational(t) && s.stiffness_scale == 1.0 && s.denatured.empty() &&
         std::fabs(h - t.step) <= 1e-12 * t.step;
}
/// Copies that cuts made: the whole object's factor is not that of the mesh.
bool divided(const TissueModel& t, const TissueState& s) {
  return s.x.size() > t.model->mass.size();
}

/// The rigid part of a field on each group: an orthogonal projection, so that conjugate gradients between
/// projections are those of the constrained problem.
void makeRigid(const std::vector<TissueGroup>& groups, std::vector<Vector3d>& field) {
  for (const TissueGroup& g : groups) {
    Vector3d mean = Vector3d::Zero(), moment = Vector3d::Zero();
    for (int i = 0; i < g.count; ++i) {
      mean += field[g.knots[i]];
      moment += g.arm[i].cross(field[g.knots[i]]);
    }
    mean /= g.count;
    const Vector3d turn = g.inverse * moment;
    for (int i = 0; i < g.count; ++i) field[g.knots[i]] = mean + turn.cross(g.arm[i]);
  }
}

/// z = preconditioner·r: the factor at rest, turned with the elements at each knot (stiffness warping), of
/// the cut mesh where it is cut. Where that is singular to rounding, copies that cuts made share the answer
/// of their origin, and add what moves them apart through the diagonal.
void precondition(const TissueModel& t, const TissueState& s, TissueScratch& w,
                  const std::vector<Vector3d>& r, std::vector<Vector3d>& z) {
  const Model& m = *t.model;
  const bool turning = corotational(t), cut = divided(t, s);
  if (cut && w.cut && w.cut->renew(t, s)) {
    if (!turning) {
      w.cut->solve(s, r, z);
      return;
    }
    for (std::size_t k = 0; k < s.x.size(); ++k)
      w.turned[k] = w.rotation[s.knot_element[k]].transpose() * r[k];
    w.cut->solve(s, w.turned, z);
    for (std::size_t k = 0; k < s.x.size(); ++k) z[k] = w.rotation[s.knot_element[k]] * z[k];
    return;
  }
  w.work.setZero();
  for (std::size_t k = 0; k < s.x.size(); ++k) {
    const std::int32_t row = m.unknown[s.origin[k]];
    if (row < 0) continue;
    if (turning)
      w.work.segment<3>(3 * row) += w.rotation[s.knot_element[k]].transpose() * r[k];
    else
      w.work.segment<3>(3 * row) += r[k];
  }
  w.factor.solve(w.work.data());
  for (std::size_t k = 0; k < s.x.size(); ++k) {
    const std::int32_t row = m.unknown[s.origin[k]];
    if (row < 0)
      z[k].setZero();
    else if (turning)
      z[k] = w.rotation[s.knot_element[k]] * w.work.segment<3>(3 * row);
    else
      z[k] = w.work.segment<3>(3 * row);
  }
  if (!cut) return;
  for (std::size_t k = m.mass.size(); k < s.x.size(); ++k) {
    w.count[s.origin[k]] = 0;
    w.sum[s.origin[k]].setZero();
  }
  const auto each = [&](auto visit) {
    for (std::size_t k = m.mass.size(); k < s.x.size(); ++k) visit(k);
  };
  each([&](std::size_t k) {
    const Index o = s.origin[k];
    if (w.count[o] == 0) w.sum[o] = r[o], w.count[o] = 1;
    w.sum[o] += r[k];
    ++w.count[o];
  });
  const auto apart = [&](std::size_t k) {
    const Index o = s.origin[k];
    if (m.unknown[o] < 0) return;
    z[k] += (t.loose_inverse[o] * w.count[o]) * (r[k] - w.sum[o] / static_cast<double>(w.count[o]));
  };
  each(apart);
  each([&](std::size_t k) {  // the origin itself, once
    const Index o = s.origin[k];
    if (w.count[o] == 0) return;
    apart(o);
    w.count[o] = 0;
  });
}

double dot(const TissueState& s, const std::vector<Vector3d>& a, const std::vector<Vector3d>& b) {
  double sum = 0.0;
  for (std::size_t k = 0; k < s.x.size(); ++k) sum += a[k].dot(b[k]);
  return sum;
}

/// q = (mass_factor M + stiffness_factor K_R) p on free knots.
void matrixTimes(const TissueModel& t, const TissueState& s, double h, const TissueScratch& w,
                 const std::vector<Vector3d>& p, std::vector<Vector3d>& q) {
  const Material& material = t.model->description.material;
  const double mass_factor = 1.0 + h * material.rayleigh_mass,
               stiffness_factor = h * (h + material.rayleigh_stiffness);
  minusStiffnessTimes(t, s, w, p, q);
  for (std::size_t k = 0; k < s.x.size(); ++k) {
    q[k] = isFree(t, s, k) ? Vector3d(mass_factor * s.mass[k] * p[k] - stiffness_factor * q[k])
                           : Vector3d(Vector3d::Zero());
  }
}

/// w.v_next += A^-1 w.r with A = (1 + h a) M + h (h + b) K_R, among the changes that are rigid on each group;
/// w.r becomes what is left, on the groups the opposite of their impulses. Preconditioned conjugate
/// gradients: each iterate lowers ½ x·A x - r·x, so that a solve that is cut short stays bounded.
void solve(const TissueModel& t, const TissueState& s, double h, TissueScratch& w) {
  const std::size_t n = s.x.size();
  for (std::size_t k = 0; k < n; ++k)
    if (!isFree(t, s, k)) w.r[k].setZero();
  w.iterations = 0;
  w.residual = 0.0;
  if (w.groups.empty() && exact(t, s, h) && (!divided(t, s) || (w.cut && w.cut->renew(t, s)))) {
    precondition(t, s, w, w.r, w.z);
    for (std::size_t k = 0; k < n; ++k) w.v_next[k] += w.z[k];
    return;
  }
  // w.r stays the whole residual; its part that moves the groups as rigid bodies is what is solved for.
  const auto preconditioned = [&] {
    std::size_t held = 0;
    for (const TissueGroup& g : w.groups)
      for (int i = 0; i < g.count; ++i) w.group_residual[held++] = w.r[g.knots[i]];
    makeRigid(w.groups, w.r);
    precondition(t, s, w, w.r, w.z);
    makeRigid(w.groups, w.z);
    held = 0;
    for (const TissueGroup& g : w.groups)
      for (int i = 0; i < g.count; ++i) w.r[g.knots[i]] = w.group_residual[held++];
  };
  preconditioned();
  double rho = dot(s, w.r, w.z);
  const double start = rho;
  double total = 0.0;
  for (std::size_t k = 0; k < n; ++k) total += s.mass[k];
  double size = 0.0;
  for (std::size_t k = 0; k < n; ++k) size += w.r[k].squaredNorm();
  const double least = std::max(kTolerance * kTolerance * start, total * w.quiet * w.quiet);
  if (!(start > least)) return;
  for (std::size_t k = 0; k < n; ++k) w.p[k] = w.z[k];
  for (int i = 0; i < w.most_iterations; ++i) {
    matrixTimes(t, s, h, w, w.p, w.q);
    const double curvature = dot(s, w.p, w.q);
    if (!(curvature > 0.0)) break;
    const double alpha = rho / curvature;
    for (std::size_t k = 0; k < n; ++k) {
      w.v_next[k] += alpha * w.p[k];
      w.r[k] -= alpha * w.q[k];
    }
    ++w.iterations;
    double left = 0.0;  // an exact update leaves rounding: not worth another answer
    for (std::size_t k = 0; k < n; ++k) left += w.r[k].squaredNorm();
    if (w.groups.empty() && !(left > kRounding * size)) break;
    preconditioned();
    const double next = dot(s, w.r, w.z);
    w.residual = next > least ? std::sqrt(std::max(next, 0.0) / start) : 0.0;
    if (!(next > least)) break;
    const double beta = next / rho;
    rho = next;
    for (std::size_t k = 0; k < n; ++k) w.p[k] = w.z[k] + beta * w.p[k];
  }
}

/// What the groups took: after each solve.
void addImpulses(TissueScratch& w) {
  for (TissueGroup& g : w.groups)
    for (int i = 0; i < g.count; ++i) g.impulse[i] -= w.r[g.knots[i]];
}

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

void prepareGroup(TissueGroup& g) {
  Vector3d mean = Vector3d::Zero();
  for (int i = 0; i < g.count; ++i) mean += g.goal[i] / g.count;
  Matrix3d inertia = Matrix3d::Zero();
  for (int i = 0; i < g.count; ++i) {
    g.arm[i] = g.goal[i] - mean;
    inertia += g.arm[i].squaredNorm() * Matrix3d::Identity() - g.arm[i] * g.arm[i].transpose();
  }
  // Knots in a line have no inertia about it, and no moment either.
  inertia += std::max(1e-12 * inertia.trace(), 1e-30) * Matrix3d::Identity();
  g.inverse = inertia.inverse();
}

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
  if (!s.dynamic) {
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
  tissueForces(t, s, w);
  minusStiffnessTimes(t, s, w, s.v, w.q);
  bool finite = true;
  for (std::size_t k = 0; k < n; ++k) {
    w.v_next[k] = s.v[k];
    if (!isFree(t, s, k)) {
      w.r[k].setZero();
      w.v_next[k].setZero();
      continue;
    }
    Vector3d f(held[0][k], held[1][k], held[2][k]);
    const Index o = s.origin[k];
    f += (s.mass[k] / m.mass[o]) * m.load[o];  // halves of a load go with the halves of the mass
    w.r[k] = h * (f + w.force[k] - (a * s.mass[k]) * s.v[k] + (h + b) * w.q[k]);
    finite = finite && w.r[k].allFinite();
  }
  if (!finite) return false;
  if (!w.groups.empty()) {
    // Begin with velocities that bring the groups to their shapes.
    makeRigid(w.groups, w.v_next);
    for (const TissueGroup& g : w.groups)
      for (int i = 0; i < g.count; ++i) w.v_next[g.knots[i]] += (g.goal[i] - s.x[g.knots[i]]) / h;
    for (std::size_t k = 0; k < n; ++k) w.p[k] = w.v_next[k] - s.v[k];
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
  if (w.threads.empty() || (w.groups.empty() && exact(t, s, h) && !divided(t, s))) return;
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
  if (!s.dynamic) {
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
  if (!s.dynamic) {
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
  for (std::size_t k = 0; k < n; ++k) {
    if (!isFree(t, s, k)) continue;
    s.v[k] = w.v_next[k];
    s.x[k] += h * s.v[k];
  }
  return true;
}

}  // namespace vest::fem
