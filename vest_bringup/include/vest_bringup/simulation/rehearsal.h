#pragma once

#include <array>
#include <functional>
#include <string>
#include <vector>

#include "vest_instruments/control/pedals.h"
#include "vest_instruments/trajectory/trajectory.h"
#include "vest_tissue/scene/runner.h"

namespace vest::simulation {

/// What a scripted motion did to a scene, found without box, ROS or wall time.
struct RehearsalReport {
  std::vector<scene::Event> events;
  double tube_displacement =
      0;                      ///< m: farthest that a knot of an object named tube* came from where it began
  std::string tube;           ///< its name
  double greatest_force = 0;  ///< N, on any instrument
  scene::Status worst = scene::Status::Ok;
  double settled_speed = 0;  ///< m/s: greatest of all knots and threads at the end
  std::string fastest;       ///< object with the fastest knot at the end
};

/// Tools of a scripted trainee: what each hand begins with, and what the tool pedal hands over.
struct Hands {
  std::array<tools::ToolKind, tools::kInstrumentCount> tool{};
  std::vector<tools::ToolKind> tray;  ///< press by press, round and round; empty: the pedal does nothing
  tools::Instrument tray_hand = tools::Instrument::Right;
};

/// Hands as a session gives them: what the trajectory says, else graspers left and right and nothing third.
Hands handsOf(const trajectory::Trajectory& trajectory);

/// Inputs of a trajectory step by step, with footswitches and tools as the instruments' node takes them
/// (pedals of the preset `trainer`). Times must not go back.
class Script {
 public:
  Script(const kinematics::TrainerBox& box, const trajectory::Trajectory& trajectory, Hands hands);
  /// @param t s since the beginning
  scene::StepInput inputAt(double t);

 private:
  const kinematics::TrainerBox& box_;
  const trajectory::Trajectory& trajectory_;
  Hands hands_;
  control::Pedals pedals_;
  std::size_t tray_place_ = 0;
  std::array<bool, tools::kInstrumentCount> was_open_{};
};

/// Joints of an instrument at a time of a trajectory that moves it (s; before and after it: its ends').
kinematics::JointPositions jointsAt(const trajectory::Trajectory& trajectory, tools::Instrument instrument,
                                    double t);
/// Pedals that are down at `from`, or go down after it until `to` (s).
unsigned footswitches(const trajectory::Trajectory& trajectory, double from, double to);

/// Told after each step: time since the beginning (s), what was consumed, what came of it.
using Watch = std::function<void(double t, const scene::StepInput& input, const scene::StepReport& report)>;

/// Plays a trajectory through the kinematics of the box into a simulation, step by step.
/// @param seconds 0: the whole trajectory  @param watch may be empty
/// @param ended asked after each step whether nothing more is wanted; may be empty
RehearsalReport rehearse(scene::Simulation& simulation, const kinematics::TrainerBox& box,
                         const trajectory::Trajectory& trajectory, const Hands& hands, double seconds = 0,
                         const Watch& watch = {}, const std::function<bool()>& ended = {});

/// One instrument as a step consumes it, in world (of a box that does not stand tilted).
scene::ToolInput toolInput(const kinematics::TrainerArm& arm, tools::ToolKind tool,
                           const kinematics::JointPositions& joints);

/// As the instruments do: a handle that was open fires while it is closed.
void fireByHandle(bool& was_open, scene::ToolInput& tool);

/// Input of one step at a time of the trajectory; instruments that it does not move are not there.
scene::StepInput inputAt(const kinematics::TrainerBox& box, const trajectory::Trajectory& trajectory,
                         const std::array<tools::ToolKind, tools::kInstrumentCount>& tool, double t);

}  // namespace vest::simulation
