#include "vest_haptics/loop/contact_force.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/Cholesky>

#include "vest_haptics/safety/limiter.h"

namespace vest::haptics {

using Eigen::Matrix3d;
using Eigen::Vector3d;

namespace {

bool finite(const double* x, int n) noexcept {
  for (int i = 0; i < n; ++i) {
    if (!isFinite(x[i])) return false;
  }
  return true;
}

Vector3d within(const Vector3d& d, double radius) noexcept {
  const double length = std::sqrt(d.squaredNorm());
  return length > radius ? Vector3d(d * (radius / length)) : d;
}

// Upper left 3×3 block, symmetric part.
Matrix3d block(const double* m) noexcept {
  Matrix3d out;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) out(i, j) = 0.5 * (m[6 * i + j] + m[6 * j + i]);
  }
  return out;
}

void shareOut(TissueModel& m) noexcept;

bool believable(const Matrix3d& m) noexcept {
  for (int i = 0; i < 3; ++i) {
    if (m(i, i) < 0.0) return false;
    for (int j = 0; j < 3; ++j) {
      if (!(std::abs(m(i, j)) <= kMostStiffness)) return false;
    }
  }
  return true;
}

}  // namespace

bool toModel(const shared::ContactRecord& r, TissueModel& model, const char** why) noexcept {
  const auto refuse = [&](const char* field) {
    if (why) *why = field;
    return false;
  };
  const int planes = static_cast<int>(r.plane_count);
  if (r.plane_count > shared::kContactPlanes) return refuse("number of planes");
  if (!finite(r.position, 3) || !finite(r.commanded, 3) || !finite(r.velocity, 6) || !finite(r.wrench, 6) ||
      !finite(r.stiffness, 36) || !finite(r.damping, 36) || !isFinite(r.radius) || !isFinite(r.jaw_torque)) {
    return refuse("a number that is not finite");
  }
  TissueModel m;
  m.grasping = (r.flags & shared::kFlagGrasping) != 0;
  m.present = (r.flags & shared::kFlagPresent) != 0;
  m.active = m.present && ((r.flags & shared::kFlagContact) != 0 || m.grasping);
  m.position = Vector3d(r.position);
  m.commanded = Vector3d(r.commanded);
  m.arrived = !m.present || std::sqrt((m.position - m.commanded).squaredNorm()) <= kArrived;
  m.velocity = Vector3d(r.velocity);
  m.force = Vector3d(r.wrench);
  m.torque = Vector3d(r.wrench + 3);
  m.stiffness = block(r.stiffness);
  m.damping = block(r.damping);
  m.radius = r.radius;
  m.jaw_torque = r.jaw_torque;
  if (!believable(m.stiffness)) return refuse("stiffness");
  if (!believable(m.damping)) return refuse("damping");
  if (m.radius < 0.0) return refuse("radius");
  if (!(std::sqrt(m.force.squaredNorm()) <= kMostForce)) return refuse("force");
  m.planes = planes;
  for (int i = 0; i < planes; ++i) {
    if (!finite(r.planes[i], 4)) return refuse("plane");
    m.normal[i] = Vector3d(r.planes[i]);
    m.offset[i] = r.planes[i][3];
    if (!(std::abs(m.normal[i].squaredNorm() - 1.0) < 0.01)) return refuse("normal of a plane");
  }
  shareOut(m);
  model = m;
  return true;
}

namespace {

// Multipliers λ ≥ 0 of least squares: Gauss-Seidel, projected, on a Gram matrix with ones on its diagonal.
template <class Gram>
void notNegative(int n, const Gram& gram, const double* right, double* out) noexcept {
  constexpr int kSweeps = 200;  // four planes 30° apart: within 1e-6
  for (int i = 0; i < n; ++i) out[i] = 0.0;
  for (int sweep = 0; sweep < (n > 1 ? kSweeps : 1); ++sweep) {
    for (int i = 0; i < n; ++i) {
      double x = right[i];
      for (int j = 0; j < n; ++j) x -= j == i ? 0.0 : gram(i, j) * out[j];
      out[i] = std::max(0.0, x);
    }
  }
}

// Part of a force that the planes can push with.
Vector3d pushOf(const TissueModel& m, const Vector3d& force) noexcept {
  double right[shared::kContactPlanes], share[shared::kContactPlanes];
  for (int i = 0; i < m.planes; ++i) right[i] = m.normal[i].dot(force);
  notNegative(
      m.planes, [&](int i, int j) { return m.normal[i].dot(m.normal[j]); }, right, share);
  Vector3d push = Vector3d::Zero();
  for (int i = 0; i < m.planes; ++i) push += share[i] * m.normal[i];
  return push;
}

// Bit i: the point x0 + d is below plane i.
unsigned below(const TissueModel& m, const Vector3d& d) noexcept {
  unsigned out = 0;
  for (int i = 0; i < m.planes; ++i) {
    if (m.normal[i].dot(m.position + d) < m.offset[i]) out |= 1u << i;
  }
  return out;
}

// K = Σ k n nᵀ + what is along the surfaces, least squares over the entries of K.
void shareOut(TissueModel& m) noexcept {
  double right[shared::kContactPlanes];
  for (int i = 0; i < m.planes; ++i) right[i] = m.normal[i].dot(m.stiffness * m.normal[i]);
  const auto gram = [&](int i, int j) {
    const double c = m.normal[i].dot(m.normal[j]);
    return c * c;
  };
  notNegative(m.planes, gram, right, m.plane_stiffness);
}

// Force of the planes that still push, where the tip has left others: each by its own stiffness, and of the
// rest of the whole force what the planes that were left had no part in.
Vector3d partly(const TissueModel& m, unsigned pushing, const Vector3d& d, const Vector3d& whole,
                const Vector3d& whole_d) noexcept {
  Vector3d push = Vector3d::Zero(), rest = whole;
  for (int i = 0; i < m.planes; ++i) {
    const Vector3d& n = m.normal[i];
    const double gap = m.offset[i] - n.dot(m.position);
    rest -= m.plane_stiffness[i] * (gap - n.dot(whole_d)) * n;
    if (pushing >> i & 1u) push += m.plane_stiffness[i] * (gap - n.dot(d)) * n;
  }
  for (int i = 0; i < m.planes; ++i) {
    if (!(pushing >> i & 1u)) rest -= m.normal[i].dot(rest) * m.normal[i];
  }
  return push + rest;
}

// The proxy on the planes alone, d = p − x0: least energy of the coupling and of the planes that it is below.
// Four planes at most, so each set of them is tried.
Vector3d onPlanes(const TissueModel& m, double coupling, const Vector3d& hand) noexcept {
  Vector3d best = hand;
  double least = std::numeric_limits<double>::infinity();
  for (unsigned set = 0; set < 1u << m.planes; ++set) {
    Matrix3d a = coupling * Matrix3d::Identity();
    Vector3d right = coupling * hand;
    for (int i = 0; i < m.planes; ++i) {
      const Vector3d& n = m.normal[i];
      const double k = set >> i & 1u ? m.plane_stiffness[i] : 0.0;
      a += k * n * n.transpose();
      right += k * (m.offset[i] - n.dot(m.position)) * n;
    }
    const Vector3d d = within(a.ldlt().solve(right), m.radius);
    double energy = coupling * (d - hand).squaredNorm();
    for (int i = 0; i < m.planes; ++i) {
      const double depth = std::max(0.0, m.offset[i] - m.normal[i].dot(m.position + d));
      energy += m.plane_stiffness[i] * depth * depth;
    }
    if (energy < least) {
      least = energy;
      best = d;
    }
  }
  return best;
}

}  // namespace

Vector3d ContactForce::trueForce(const Vector3d& x, const Vector3d& v) const noexcept {
  if (!model_.active) return Vector3d::Zero();
  const TissueModel& m = model_;
  const Vector3d d = within(x - m.position, m.radius);
  const Vector3d whole = m.force - m.stiffness * d - m.damping * (v - m.velocity);
  if (m.grasping) return whole;
  return unilateral(m, partly(m, below(m, d), d, whole, d));
}

Vector3d ContactForce::unilateral(const TissueModel& m, Vector3d force) const noexcept {
  if (m.grasping || m.planes == 0) return force;
  const Vector3d push = pushOf(m, force), model_push = pushOf(m, m.force);
  const double hardness = std::sqrt(model_push.squaredNorm());
  const double ratio = hardness > 1e-9 ? std::sqrt((m.force - model_push).squaredNorm()) / hardness : 0.0;
  return push + within(force - push, (ratio + kExtraFriction) * std::sqrt(push.squaredNorm()));
}

ContactForce::Found ContactForce::coupled(const TissueModel& m, const Vector3d& x,
                                          const Vector3d& v) const noexcept {
  if (!m.active) return {Vector3d::Zero(), Vector3d::Zero()};
  // Damping of contact comes and goes with noise of the velocity: bounded.
  const double most = m.damping.diagonal().maxCoeff();
  const double share = most > kMostDamping ? kMostDamping / most : 1.0;
  const Vector3d constant = m.force - share * (m.damping * (v - m.velocity));
  // Kc (p − x) = constant − K (p − x0), in d = p − x0.
  Matrix3d a = m.stiffness;
  a.diagonal().array() += coupling_;
  Vector3d d = within(a.ldlt().solve(coupling_ * (x - m.position) + constant), m.radius);
  const Vector3d whole = constant - m.stiffness * d;
  const unsigned all = (1u << m.planes) - 1u;
  // Where p may not go as far as it should, the two sides differ: the weaker holds.
  const auto bounded = [&](const Vector3d& force) {
    return within(force, coupling_ * std::sqrt((m.position + d - x).squaredNorm()));
  };
  if (m.grasping || below(m, d) == all) return {d, bounded(whole)};
  // Planes that p has left do not act.
  const Vector3d whole_d = d;
  d = onPlanes(m, coupling_, x - m.position);
  return {d, bounded(partly(m, below(m, d), d, whole, whole_d))};
}

Vector3d ContactForce::proxy(const Vector3d& x, const Vector3d& v) const noexcept {
  return model_.position + coupled(model_, x, v).d;
}

void ContactForce::update(const TissueModel& model, const Vector3d& x, const Vector3d& v) noexcept {
  const Vector3d before = coupled(model_, x, v).force + residual_;
  residual_ = before - coupled(model, x, v).force;
  model_ = model;
}

void ContactForce::couple(double coupling, const Vector3d& x, const Vector3d& v) noexcept {
  const Vector3d before = coupled(model_, x, v).force + residual_;
  coupling_ = coupling;
  residual_ = before - coupled(model_, x, v).force;
}

Vector3d ContactForce::evaluate(const Vector3d& x, const Vector3d& v, double dt) noexcept {
  residual_ *= std::exp(-dt / kBlend);
  if (residual_.squaredNorm() < 1e-18) residual_.setZero();
  last_ = unilateral(model_, coupled(model_, x, v).force + residual_);
  return last_;
}

double ContactForce::storedEnergy() const noexcept {
  constexpr double kMargin = 0.002;  // J, assumed: what noise of the sensors may add up to
  const double square = last_.squaredNorm();
  const double k = last_.dot(model_.stiffness * last_) / square;  // of no force: no number, so not > 0
  const double series = k > 0.0 ? 1.0 / (1.0 / k + 1.0 / coupling_) : coupling_;
  return 1.5 * 0.5 * square / series + kMargin;
}

void ContactForce::reset() noexcept {
  model_ = TissueModel{};
  residual_.setZero();
  last_.setZero();
}

}  // namespace vest::haptics
