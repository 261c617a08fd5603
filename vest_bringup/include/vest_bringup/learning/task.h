#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "vest_bringup/exercise/exercise.h"
#include "vest_bringup/simulation/stage.h"
#include "vest_instruments/kinematics/trainer_box.h"
#include "vest_instruments/trajectory/trajectory.h"
#include "vest_instruments/trajectory/waypoint.h"
#include "vest_tissue/scene/world_model.h"

/// Tasks for learning: the Trainer in lockstep with an agent, without ROS and without wall time.
namespace vest::learning {

/// Numbers of an action of one hand, each in [−1, 1] (outside: clamped; not a number: 0): motion of the tip
/// in world x, y, z (2 mm), roll (0.1 rad), opening of the jaw (0.1 rad), functions of the tool (on where >
/// 0).
inline constexpr std::size_t kActionSize = 6;
inline constexpr double kTipStep = 0.002, kTurnStep = 0.1;  ///< m, rad: what an action of 1 does

enum class TaskKind : std::uint8_t {
  Reach,
  GraspLift,
  Retract,
  Clip,
  Cut,
  Suck,
  CameraFollow,
  PassNeedle,
  TieThrow
};

/// Numbers of an action of each instrument of an exercise: the five of above, then two functions of the tool
/// (coagulation or suction; cutting or irrigation; on where > 0), and the next tool (where it rises above 0).
inline constexpr std::size_t kExerciseActionSize = 8;

/// What is asked of a hand, or of both; one row of tasks().
struct TaskRow {
  TaskKind kind;
  const char* name;
  const char* scene;  ///< of vest_tissue
  const char* object;
  tools::Instrument hand;
  tools::ToolKind tool;
  double roll;  ///< rad: what the shaft is best turned by; 0.77 closes jaws across the tubes of these scenes
  double beyond;      ///< m: how far along the shaft the tip goes beyond the middle of the tube
  double open_jaw;    ///< rad, at the start
  double limit;       ///< s
  bool both = false;  ///< the left hand acts, too, with a grasper
};
const std::vector<TaskRow>& tasks();
/// "reach, grasp_lift, …"
std::string taskNames();

/// The right hand of `pass_needle`: takes the needle from its tray until kNeedleTaken, then drives it through
/// the pad along its arc. As trajectories/suture_pad.yaml has it.
const std::vector<trajectory::Waypoint>& needleMotion();
inline constexpr double kNeedleTaken = 5.0;  ///< s
/// m, world: where that motion pierces the pad, and how far from there the point comes out
extern const Eigen::Vector3d kNeedleEntry, kNeedleWay;

/// Both hands of `tie_throw`, left and right: as trajectories/thread_throw.yaml has them until the throw is
/// drawn. The left one takes the long end and lays it twice round the right one, which takes the short end.
const std::array<std::vector<trajectory::Waypoint>, 2>& throwMotion();
inline constexpr double kThrowBegins =
    2.5;  ///< s: where an episode begins in it; the thread hangs still then

struct TaskOptions {
  std::string task;     ///< one of tasks(), or the path of an exercise file
  std::string scene;    ///< scene file
  std::string box;      ///< trainer_box.yaml
  std::string vessels;  ///< folder of the vessels' database; empty: tissue and instruments without effects.
                        ///< Exercises need it
  int skip = 20;        ///< simulated steps for one action, 1 … 1000
  double limit = 0;     ///< s until an episode is truncated; 0: the task's
};

/// A place that observations of an exercise tell: a mark, or a knot of an object that the exercise names.
struct Landmark {
  static constexpr std::size_t kStands = static_cast<std::size_t>(-1);
  std::size_t object = kStands;                  ///< of the scene
  std::size_t knot = 0;                          ///< that it moves with
  Eigen::Vector3d at = Eigen::Vector3d::Zero();  ///< m: offset from the knot; of one that stands: the place
};

/// What all environments of a task share. Immutable once made.
struct Task {
  TaskRow row;
  TaskOptions options;
  kinematics::TrainerBox box;
  std::shared_ptr<const scene::WorldModel> model;
  std::size_t object = 0;           ///< the tube, or the pad
  double limit = 0;                 ///< s
  std::vector<std::uint8_t> start;  ///< snapshot of the Trainer that an episode begins with; empty: the scene
  double pool = 0;                  ///< m³ that stand in the field then
  kinematics::JointPositions from{};  ///< of the hand then, where it holds something

  // Of an exercise.
  std::shared_ptr<const exercise::Exercise> exercise;  ///< null: one of tasks()
  trajectory::Trajectory script;                       ///< the one that passes
  std::vector<tools::Instrument> hands;                ///< in the order of actions and observations
  std::vector<Landmark> landmarks;

  std::vector<std::string> names;  ///< of the numbers of an observation, in order, with units

  std::size_t actionSize() const;
  std::size_t observationSize() const { return names.size(); }
  std::uint64_t number() const;  ///< tells tasks and exercises apart in snapshots

  /// A Trainer of this task, with its effects.
  simulation::Stage stage(int threads) const;
};

/// Loads the scene and builds its Model once. @throws std::invalid_argument, files::FileError
std::shared_ptr<const Task> makeTask(const TaskOptions& options);
/// Of an exercise: fills what it has beside options. @throws std::invalid_argument naming file and reason
void prepareExercise(Task& task);

}  // namespace vest::learning
