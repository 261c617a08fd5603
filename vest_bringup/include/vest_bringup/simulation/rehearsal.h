#pragma once

#include <array>
#include <string>
#include <vector>

#include "vest_instruments/trajectory/trajectory.h"
#include "vest_tissue/scene/world.h"

namespace vest::simulation {

/// What a scripted motion did to a scene, found without box, ROS or wall time.
struct RehearsalReport {
  std::vector<scene::Event> events;
  double tube_displacement =
      0;                      ///< m: farthest that a knot of an object named tube* came from where it began
  std::string tube;           ///< its name
  double greatest_force = 0;  ///< N, on any instrument
  scene::Status worst = scene::Status::Ok;
  double settled_speed = 0;  ///< m/s: greatest of all knots at the end
};

/// Plays a trajectory through the kinematics of the box into the World, step by step.
/// @param tool kind per instrument  @param seconds 0: the whole trajectory
RehearsalReport rehearse(scene::World& world, const kinematics::TrainerBox& box,
                         const trajectory::Trajectory& trajectory,
                         const std::array<tools::ToolKind, tools::kInstrumentCount>& tool,
                         double seconds = 0);

/// Input of one step at a time of the trajectory; instruments that it does not move are not there.
scene::StepInput inputAt(const kinematics::TrainerBox& box, const trajectory::Trajectory& trajectory,
                         const std::array<tools::ToolKind, tools::kInstrumentCount>& tool, double t);

}  // namespace vest::simulation
