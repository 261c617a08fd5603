#include "vest_tissue/fem/bodies.h"

namespace vest::fem {

CondensedBody::CondensedBody(const CondensedModel& model, CondensedState& state)
    : model_(model),
      state_(state),
      scratch_(model),
      u_(Eigen::VectorXd::Zero(model.unknowns())),
      pending_(u_) {
  touch_.unknown.reserve(12);
  touch_.force.reserve(12);
}

void CondensedBody::setPermanentLoad(const SparseLoad& load) {
  permanent_ = load;
}

void CondensedBody::beginStep(double dt) {
  dt_ = dt;
  pending_.setZero();
  addResponse(model_, state_, permanent_, scratch_, pending_);
}

void CondensedBody::endStep() {
  u_ = pending_;
}

bool CondensedBody::answers(std::uint32_t node) const {
  return model_.outerNumber(node) >= 0 && state_.loose[node] == 0;
}

Eigen::Vector3d CondensedBody::interpolate(const net::Anchor& anchor, const Eigen::VectorXd& u) const {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (std::size_t k = 0; k < 4; ++k) {
    if (anchor.weights[k] == 0.0 || !answers(anchor.knots[k])) continue;
    sum += anchor.weights[k] * u.segment<3>(3 * model_.outerNumber(anchor.knots[k]));
  }
  return sum;
}

Eigen::Vector3d CondensedBody::position(const net::Anchor& anchor) const {
  Eigen::Vector3d rest = Eigen::Vector3d::Zero();
  for (std::size_t k = 0; k < 4; ++k) {
    if (anchor.weights[k] != 0.0) rest += anchor.weights[k] * model_.description().nodes[anchor.knots[k]];
  }
  return rest + interpolate(anchor, u_);
}

Eigen::Vector3d CondensedBody::velocity(const net::Anchor& anchor) const {
  return (interpolate(anchor, pending_) - interpolate(anchor, u_)) / dt_;
}

void CondensedBody::applyImpulse(const net::Anchor& anchor, const Eigen::Vector3d& impulse) {
  touch_.unknown.clear();
  touch_.force.clear();
  for (std::size_t k = 0; k < 4; ++k) {
    if (anchor.weights[k] == 0.0 || !answers(anchor.knots[k])) continue;
    for (int d = 0; d < 3; ++d) {
      touch_.unknown.push_back(static_cast<std::uint32_t>(3 * model_.outerNumber(anchor.knots[k]) + d));
      touch_.force.push_back(anchor.weights[k] * impulse[d] / dt_);
    }
  }
  addResponse(model_, state_, touch_, scratch_, pending_);
}

Eigen::Matrix3d CondensedBody::compliance(const net::Anchor& anchor) const {
  Eigen::Matrix3d C = Eigen::Matrix3d::Zero();
  for (std::size_t a = 0; a < 4; ++a) {
    if (anchor.weights[a] == 0.0 || !answers(anchor.knots[a])) continue;
    for (std::size_t b = 0; b < 4; ++b) {
      if (anchor.weights[b] == 0.0 || !answers(anchor.knots[b])) continue;
      C += (anchor.weights[a] * anchor.weights[b]) *
           complianceBlock(model_, state_, static_cast<std::uint32_t>(model_.outerNumber(anchor.knots[a])),
                           static_cast<std::uint32_t>(model_.outerNumber(anchor.knots[b])));
    }
  }
  return 0.5 * (C + C.transpose());
}

DynamicBody::DynamicBody(const Model& model, State& state, Scratch& scratch)
    : model_(model),
      state_(state),
      scratch_(scratch),
      work_(Eigen::VectorXd::Zero(static_cast<Eigen::Index>(3 * model.free_node.size()))) {}

StepStatus DynamicBody::beginStep(const StepOptions& options) {
  options_ = options;
  const StepStatus status = fem::beginStep(model_, options_, state_, scratch_);
  open_ = status == StepStatus::Ok;
  return status;
}

void DynamicBody::endStep() {
  if (open_) fem::endStep(model_, options_, state_, scratch_);
  open_ = false;
}

Eigen::Vector3d DynamicBody::position(const net::Anchor& anchor) const {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (std::size_t k = 0; k < 4; ++k) {
    if (anchor.weights[k] != 0.0) sum += anchor.weights[k] * state_.x[anchor.knots[k]];
  }
  return sum;
}

Eigen::Vector3d DynamicBody::velocity(const net::Anchor& anchor) const {
  const std::vector<Eigen::Vector3d>& v = open_ ? scratch_.v_next : state_.v;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (std::size_t k = 0; k < 4; ++k) {
    if (anchor.weights[k] != 0.0) sum += anchor.weights[k] * v[anchor.knots[k]];
  }
  return sum;
}

/// work_ = A^-1 W J. False: nothing of the anchor can move.
bool DynamicBody::spread(const net::Anchor& anchor, const Eigen::Vector3d& impulse) const {
  if (!open_) return false;
  work_.setZero();
  bool moves = false;
  for (std::size_t k = 0; k < 4; ++k) {
    if (anchor.weights[k] == 0.0 || model_.unknown[anchor.knots[k]] < 0) continue;
    work_.segment<3>(3 * model_.unknown[anchor.knots[k]]) += anchor.weights[k] * impulse;
    moves = true;
  }
  if (moves) scratch_.matrix.solve(work_.data());
  return moves;
}

void DynamicBody::applyImpulse(const net::Anchor& anchor, const Eigen::Vector3d& impulse) {
  if (!spread(anchor, impulse)) return;
  for (std::size_t i = 0; i < model_.free_node.size(); ++i) {
    scratch_.v_next[model_.free_node[i]] += work_.segment<3>(static_cast<Eigen::Index>(3 * i));
  }
}

Eigen::Matrix3d DynamicBody::compliance(const net::Anchor& anchor) const {
  Eigen::Matrix3d C = Eigen::Matrix3d::Zero();
  for (int d = 0; d < 3; ++d) {
    if (!spread(anchor, Eigen::Vector3d::Unit(d))) return C;
    for (std::size_t k = 0; k < 4; ++k) {
      if (anchor.weights[k] == 0.0 || model_.unknown[anchor.knots[k]] < 0) continue;
      C.col(d) += anchor.weights[k] * work_.segment<3>(3 * model_.unknown[anchor.knots[k]]);
    }
  }
  return (0.5 * options_.dt * options_.dt) * (C + C.transpose());
}

}  // namespace vest::fem
