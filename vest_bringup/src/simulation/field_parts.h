#pragma once

#include <cmath>

#include "vest_effects/fluid/step.h"
#include "vest_tissue/scene/world.h"

/// Parts of the operating field that need nothing of its state.
namespace vest::simulation {

inline std::array<double, 3> triple(const Eigen::Vector3d& v) {
  return {v.x(), v.y(), v.z()};
}

/// Where an instrument's tip is. The proxy does not sink into tissue as the command may.
inline Eigen::Isometry3d tipOf(const scene::StepInput& input, const scene::StepReport& report, int t) {
  if (report.contacts[t].step > 0) return report.contacts[t].proxy;
  return Eigen::Isometry3d(Eigen::Translation3d(input.tools[t].position) *
                           input.tools[t].orientation.normalized());
}

/// N: how hard an instrument presses.
inline double pressing(const scene::ContactModel& contact) {
  return contact.in_contact ? std::sqrt(contact.wrench.head<3>().squaredNorm()) : 0.0;
}
/// m: of the wad on a swab.
double swabRadius();

/// Shafts and what is beyond them, jaws as if they were closed. The lens counts its own drops, and a nozzle
/// that irrigates is where its water begins. They stand still: a hand is slow beside a jet.
void placeObstacles(const scene::StepInput& input, const scene::StepReport& report, fluid::Inputs& in);
/// What is told of a fluid, no more: the arrays are large.
void copyShown(const fluid::State& from, fluid::State& to);

}  // namespace vest::simulation
