#pragma once

#include "vest_tissue/suture/rod.h"

namespace vest::suture::specimen {

constexpr double kPi = 3.14159265358979323846;

/// A straight rod along the first axis, of length 1, EI = 1 and hardly any stretch.
inline RodDescription straight(Index segments) {
  RodDescription rod;
  rod.name = "rod";
  for (Index i = 0; i <= segments; ++i) rod.nodes.push_back({static_cast<double>(i) / segments, 0.0, 0.0});
  rod.section.radius = 0.005;
  rod.section.linear_density = 1.0;
  rod.section.stretch = 1e6;
  rod.section.shear = 4e5;
  rod.section.bend = 1.0;
  rod.section.twist = 0.7;
  return rod;
}

/// A rod, its state and the memory of its steps.
struct Moving {
  Model model;
  State state;
  Scratch scratch;
  explicit Moving(const Description& d) : model(d), state(model.start), scratch(model) {}
  explicit Moving(const RodDescription& rod, const Eigen::Vector3d& gravity = Eigen::Vector3d::Zero())
      : Moving(Description{gravity, {rod}, {}}) {}
  bool settle() { return solveStatic(model, state, scratch).converged; }
  void run(double dt, int steps) {
    for (int k = 0; k < steps; ++k) step(model, state, scratch, dt);
  }
};

}  // namespace vest::suture::specimen
