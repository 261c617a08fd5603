#pragma once

#include <vector>

#include <Eigen/Core>

#include "vest_tissue/fem/model.h"

namespace vest::fem {

enum class StepStatus : std::uint8_t { Ok = 0, Fault = 1 };  ///< Fault: the state is as before the step

struct StepOptions {
  double dt = 0.01;                                   ///< s, > 0
  Eigen::Vector3d gravity = Eigen::Vector3d::Zero();  ///< m/s²
  /// Iterations per step. 1, the default: one linear solve with the rotations of the step's start, as is
  /// usual for corotational tissue; small strain needs no more. More approach the nonlinear step's solution.
  /// The equilibrium at rest is the same for any number: there the residual f_ext - f_int is zero.
  int iterations = 1;
};

/// Backward Euler with Rayleigh damping C = a·M + b·K_R and lumped masses, one solve of
///
///     (M + dt C + dt² K_R) Δv = dt (f_ext - f_int(x) - dt K_R v) - dt C v,   v += Δv,   x += dt v.
///
/// K_R is the stiffness with the elements' rotations at the start of the step (K for small strain, where the
/// matrix is factored once). Real-time safe once a Scratch exists: no allocation, no exception.
StepStatus step(const Model& model, const StepOptions& options, State& state, Scratch& scratch);

struct StaticReport {
  bool converged = false;
  int iterations = 0;  ///< linear solves
  int load_steps = 1;
  double residual = 0.0;  ///< N, norm of unbalanced forces
  double load = 0.0;      ///< N, what it is measured against
};

/// Equilibrium under loads and gravity from the state's positions: Newton's method on the total potential
/// with the exact Hessian (projected where it is not positive definite), line search, and load steps where
/// that fails. Small strain: exact in one solve, a second one removes rounding. Velocities become zero.
StaticReport solveStatic(const Model& model, const Eigen::Vector3d& gravity, State& state, Scratch& scratch);

struct Options {
  bool equilibrium = false;  ///< true: solveStatic, false: backward Euler
  int steps = 0;
  double dt = 0.01;  ///< s
  Eigen::Vector3d gravity = Eigen::Vector3d::Zero();
  int threads = 1;
  int iterations = 1;  ///< per step
};

struct Result {
  std::vector<Eigen::Vector3d> positions;   ///< m
  std::vector<Eigen::Vector3d> velocities;  ///< m/s
  std::vector<Eigen::Vector3d>
      reactions;  ///< N per node: what holds held nodes at the end; zero for the others
  StaticReport report;
};

/// What a tool needs: build, run, positions. @throws std::invalid_argument (bad input), std::runtime_error
/// (no equilibrium found, or a step failed), both naming the object.
Result simulate(const Description& description, const Options& options);

}  // namespace vest::fem
