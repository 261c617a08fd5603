#pragma once

#include <vector>

#include <Eigen/Core>

#include "vest_tissue/fem/condensed.h"
#include "vest_tissue/fem/simulate.h"
#include "vest_tissue/solver/body.h"

namespace vest::fem {

/// Elastostatic object behind the one solver interface. It follows its loads without inertia: an impulse J in
/// a step of dt counts as the force J/dt held for that step, and moves the place at the step's end by C'
/// J/dt. position() is that of the step's start, velocity() the displacement of the present step so far, over
/// dt: impulses change it at once, so that contact solvers see what they did. Without loads the next step
/// goes back to the shape under permanent loads. Anchors on held, inner or cut-off nodes: they do not answer
/// (position at rest, compliance 0). After construction nothing here allocates.
class CondensedBody final : public solver::Body {
 public:
  CondensedBody(const CondensedModel& model, CondensedState& state);

  /// Forces that act in every step (weight, loads of the scene). Allocates.
  void setPermanentLoad(const SparseLoad& load);
  void beginStep(double dt);  ///< s, > 0
  void endStep();

  Eigen::Vector3d position(const net::Anchor& anchor) const override;
  Eigen::Vector3d velocity(const net::Anchor& anchor) const override;
  void applyImpulse(const net::Anchor& anchor, const Eigen::Vector3d& impulse) override;
  Eigen::Matrix3d compliance(const net::Anchor& anchor) const override;
  const Eigen::VectorXd& displacements() const { return u_; }  ///< m, per outer unknown, at the step's start

 private:
  Eigen::Vector3d interpolate(const net::Anchor& anchor, const Eigen::VectorXd& u) const;
  bool answers(std::uint32_t node) const;
  const CondensedModel& model_;
  CondensedState& state_;
  CondensedScratch scratch_;
  SparseLoad permanent_, touch_;
  Eigen::VectorXd u_, pending_;
  double dt_ = 0.001;
};

/// Backward-Euler object (small or corotational) behind the one solver interface. Between beginStep() and
/// endStep() velocity() is that at the step's end with the impulses so far; an impulse J adds A^-1 J with the
/// step's matrix A, compliance is dt² A^-1. Each costs solves with the factor. After construction nothing
/// here allocates.
class DynamicBody final : public solver::Body {
 public:
  DynamicBody(const Model& model, State& state, Scratch& scratch);
  StepStatus beginStep(const StepOptions& options);
  void endStep();

  Eigen::Vector3d position(const net::Anchor& anchor) const override;
  Eigen::Vector3d velocity(const net::Anchor& anchor) const override;
  void applyImpulse(const net::Anchor& anchor, const Eigen::Vector3d& impulse) override;
  Eigen::Matrix3d compliance(const net::Anchor& anchor) const override;

 private:
  bool spread(const net::Anchor& anchor, const Eigen::Vector3d& impulse) const;
  const Model& model_;
  State& state_;
  Scratch& scratch_;
  StepOptions options_;
  bool open_ = false;  ///< between beginStep and endStep
  mutable Eigen::VectorXd work_;
};

}  // namespace vest::fem
