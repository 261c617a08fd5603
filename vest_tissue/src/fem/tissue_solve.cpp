#include "tissue_solve.h"

#include <algorithm>
#include <cmath>

#include "vest_tissue/fem/cut_factor.h"

namespace vest::fem {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kTolerance = 1e-7;  ///< of conjugate gradients, relative residual in the factor's norm
constexpr double kRounding = 1e-22;  ///< of the squared residual (tuned)

/// The whole object's factor, which has inertia everywhere, is not that of the mesh.
bool ownFactor(const TissueModel& t, const TissueState& s) {
  return divided(t, s) || t.motion == Motion::Elastostatic;
}

/// z = preconditioner·r: the factor at rest, turned with the elements at each knot (stiffness warping), of
/// the cut mesh where it is cut. Where that is singular to rounding, copies that cuts made share the answer
/// of their origin, and add what moves them apart through the diagonal.
void precondition(const TissueModel& t, const TissueState& s, TissueScratch& w,
                  const std::vector<Vector3d>& r, std::vector<Vector3d>& z) {
  const Model& m = *t.model;
  const bool turning = corotational(t);
  if (ownFactor(t, s) && w.cut && w.cut->renew(t, s)) {
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
  if (!divided(t, s)) return;
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

}  // namespace

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

bool exact(const TissueModel& t, const TissueState& s, const TissueScratch& w, double h) {
  return !corotational(t) && w.delay == 0.0 && s.stiffness_scale == 1.0 && s.denatured.empty() &&
         std::fabs(h - t.step) <= 1e-12 * t.step;
}

bool still(const TissueModel& t, const TissueScratch& w, std::size_t knot) {
  return t.motion == Motion::Elastostatic && w.cut->still(static_cast<Index>(knot));
}

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

void findTurning(const TissueState& s, const Vector3d& gravity, TissueScratch& w) {
  for (TissueGroup& g : w.groups) {
    Matrix3d sum = Matrix3d::Zero(), vectors;
    for (int i = 0; i < g.count; ++i) {
      const Index k = g.knots[i];
      const Vector3d f = w.force[k] + s.mass[k] * gravity;
      sum += f.dot(g.arm[i]) * Matrix3d::Identity() - f * g.arm[i].transpose();
    }
    Vector3d values;
    symmetricEigen(0.5 * (sum + sum.transpose()), values, vectors);
    g.turning = vectors * values.cwiseMax(0.0).asDiagonal() * vectors.transpose();
  }
}

void matrixTimes(const TissueModel& t, const TissueState& s, double h, const TissueScratch& w,
                 const std::vector<Vector3d>& p, std::vector<Vector3d>& q) {
  const Material& material = t.model->description.material;
  const double mass_factor = 1.0 + h * material.rayleigh_mass,
               stiffness_factor = h * (h + material.rayleigh_stiffness);
  minusStiffnessTimes(t, s, w, p, q);
  for (std::size_t k = 0; k < s.x.size(); ++k) {
    if (!isFree(t, s, k))
      q[k].setZero();
    else if (still(t, w, k))
      q[k] *= -h * (h + w.delay);
    else
      q[k] = mass_factor * s.mass[k] * p[k] - stiffness_factor * q[k];
  }
  for (const TissueGroup& g : w.groups) {
    if (t.motion != Motion::Elastostatic) break;
    Vector3d moment = Vector3d::Zero();
    for (int i = 0; i < g.count; ++i) moment += g.arm[i].cross(p[g.knots[i]]);
    const Vector3d turn = h * (h + w.delay) * (g.inverse * (g.turning * (g.inverse * moment)));
    for (int i = 0; i < g.count; ++i) q[g.knots[i]] += turn.cross(g.arm[i]);
  }
}

void solve(const TissueModel& t, const TissueState& s, double h, TissueScratch& w) {
  const std::size_t n = s.x.size();
  for (std::size_t k = 0; k < n; ++k)
    if (!isFree(t, s, k)) w.r[k].setZero();
  w.iterations = 0;
  w.residual = 0.0;
  if (w.groups.empty() && exact(t, s, w, h) && (!ownFactor(t, s) || (w.cut && w.cut->renew(t, s)))) {
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

void addImpulses(TissueScratch& w) {
  for (TissueGroup& g : w.groups)
    for (int i = 0; i < g.count; ++i) g.impulse[i] -= w.r[g.knots[i]];
}

}  // namespace vest::fem
