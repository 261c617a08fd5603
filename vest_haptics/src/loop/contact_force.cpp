#include "vest_haptics/loop/contact_force.h"

#include <algorithm>
#include <cmath>

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
  m.active = (r.flags & shared::kFlagPresent) != 0 && ((r.flags & shared::kFlagContact) != 0 || m.grasping);
  m.position = Vector3d(r.position);
  m.commanded = Vector3d(r.commanded);
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
  model = m;
  return true;
}

Vector3d ContactForce::trueForce(const Vector3d& x, const Vector3d& v) const noexcept {
  if (!model_.active) return Vector3d::Zero();
  return unilateral(model_, model_.force - model_.stiffness * within(x - model_.position, model_.radius) -
                                model_.damping * (v - model_.velocity));
}

Vector3d ContactForce::unilateral(const TissueModel& m, Vector3d force) const noexcept {
  if (m.grasping) return force;
  for (int i = 0; i < m.planes; ++i) {
    const Vector3d& n = m.normal[i];
    const double push = n.dot(force);
    if (push <= 0.0) return Vector3d::Zero();
    const Vector3d along = force - push * n;
    const double model_push = n.dot(m.force);
    const double ratio =
        model_push > 1e-9 ? std::sqrt((m.force - model_push * n).squaredNorm()) / model_push : 0.0;
    force = push * n + within(along, (ratio + kExtraFriction) * push);
  }
  return force;
}

Vector3d ContactForce::coupled(const TissueModel& m, const Vector3d& x, const Vector3d& v) const noexcept {
  if (!m.active) return Vector3d::Zero();
  // Damping of contact comes and goes with noise of the velocity: bounded.
  const double most = m.damping.diagonal().maxCoeff();
  const double share = most > kMostDamping ? kMostDamping / most : 1.0;
  const Vector3d constant = m.force - share * (m.damping * (v - m.velocity));
  // Kc (p − x) = constant − K (p − x0), in d = p − x0.
  Matrix3d a = m.stiffness;
  a.diagonal().array() += coupling_;
  const Vector3d d = within(a.ldlt().solve(coupling_ * (x - m.position) + constant), m.radius);
  return constant - m.stiffness * d;
}

void ContactForce::update(const TissueModel& model, const Vector3d& x, const Vector3d& v) noexcept {
  const Vector3d before = coupled(model_, x, v) + residual_;
  residual_ = before - coupled(model, x, v);
  model_ = model;
}

Vector3d ContactForce::evaluate(const Vector3d& x, const Vector3d& v, double dt) noexcept {
  residual_ *= std::exp(-dt / kBlend);
  if (residual_.squaredNorm() < 1e-18) residual_.setZero();
  last_ = unilateral(model_, coupled(model_, x, v) + residual_);
  return last_;
}

double ContactForce::storedEnergy() const noexcept {
  constexpr double kMargin = 0.002;  // J, ours: what noise of the sensors may add up to
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
