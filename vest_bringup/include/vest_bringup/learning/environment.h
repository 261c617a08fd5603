#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include "vest_bringup/learning/painter.h"
#include "vest_bringup/learning/task.h"
#include "vest_tissue/solver/pool.h"

namespace vest::learning {

/// Numbers of an observation, in order. Lengths in cm, angles in rad, forces in N, world frame.
///   0 goal minus tip (3)   3 tip minus where the goal was at the start (3)   6 roll minus the task's   7 jaw
///   8 force of the tissue on the tip (3)   11 jaws hold tissue (0, 1)   12 pinch force
///   13 middle of the tube at the goal's ring, or the needle's point, minus tip (3)   16 where it has to go
///   minus where it is (3) 19 score   20 share of the time that is left
/// Of `tie_throw` they are those of the right hand; 13 is the left tip minus tip, 16 where the left one has
/// to go minus where it is.
inline constexpr std::size_t kObservationSize = 21;

struct StepResult {
  double reward = 0;        ///< change of the score
  double score = 0;         ///< 0 … 1
  bool terminated = false;  ///< passed or failed
  bool truncated = false;   ///< time is up
  bool passed = false;
};

/// One trainee before one task. Same seed and actions, same bits, on one machine. Not thread-safe.
class Environment {
 public:
  /// Called before the tissue consumes an input and after the step; for recorders.
  using Watch = std::function<void(const scene::StepInput& input, const scene::StepReport& report)>;

  explicit Environment(std::shared_ptr<const Task> task, int threads = 1);

  /// Begins an episode: goal and start of the tip follow from the seed.
  void reset(std::uint64_t seed, float* observation);
  /// One action, task().actionSize() numbers: of the hand, or of the right and then the left one. Held over
  /// options.skip simulated steps. The joints go evenly to where it leads.
  /// @throws std::logic_error where the episode is over
  StepResult step(const float* action, float* observation);
  /// What a script that sees the scene does here: task().actionSize() numbers.
  void expert(float* action) const;
  void observe(float* observation) const;
  scene::ToolInput tool() const;  ///< the instrument as commanded now
  /// What the endoscope sees now. It moves in camera_follow alone. @param rgb, depth as Painter::begin()
  void picture(int width, int height, std::uint8_t* rgb, float* depth);

  /// Everything that evolves, the Trainer and its commands. Exact.
  void save(std::vector<std::uint8_t>& bytes);
  /// @throws std::invalid_argument naming what does not fit; nothing has changed then
  void restore(const std::vector<std::uint8_t>& bytes);

  const Task& task() const { return *task_; }
  scene::World& world() { return stage_.trainer->world(); }
  const scene::World& world() const { return stage_.trainer->world(); }
  std::uint64_t steps() const { return state_.steps; }  ///< actions of this episode
  std::uint64_t seed() const { return state_.seed; }
  bool over() const { return state_.over != 0; }  ///< terminated, truncated, or not begun
  void watch(Watch watch) { watch_ = std::move(watch); }

 private:
  /// Only 8-byte fields: no padding, saved as it lies.
  struct State {
    std::uint64_t seed = 0, steps = 0, ring = 0, held = 0, clipped = 0, divided = 0, failed = 0, over = 1;
    std::uint64_t was_open = 0, grasping = 0;
    kinematics::JointPositions joints{};
    std::array<double, 3> force{}, place{}, way{};  ///< N; m: goal of the tip at the start; m: way of tissue,
                                                    ///< or rad: phases of what the camera follows
    bool punctured() const { return clipped != 0; }
    double pinch = 0, distance = 0, score = 0;  ///< N; m: of tip and goal at the start; 0 … 1
    kinematics::JointPositions left{};          ///< of the other hand, where both act
    double turns = 0;                           ///< of the thread round the right instrument, at most so far
    std::array<double, 2> pull{};               ///< N, left and right: mean over the last action
  };
  static_assert(sizeof(State) == 10 * 8 + 2 * sizeof(kinematics::JointPositions) + 15 * 8);

  const kinematics::TrainerArm& arm() const;
  Eigen::Vector3d tip() const;
  Eigen::Vector3d middle() const;
  Eigen::Vector3d shaft(const Eigen::Vector3d& towards) const;
  std::size_t hand() const { return static_cast<std::size_t>(task_->row.hand); }
  Eigen::Vector3d goal() const;
  Eigen::Vector3d left() const;
  Eigen::Vector3d deepest() const;
  double pool() const;
  kinematics::JointPositions followed(std::uint64_t steps) const;
  Eigen::Vector3d target() const;
  Eigen::Vector3d lookOut() const;
  Eigen::Isometry3d camera(const kinematics::JointPositions& joints) const;
  Eigen::Isometry3d camera() const;
  bool watched() const;
  void drawPools();
  // Of tie_throw; left: the other hand.
  scene::ToolInput leftTool() const;
  Eigen::Vector3d leftTip() const;
  Eigen::Vector3d leftGoal() const;
  Eigen::Vector3d rightGoal() const;
  bool holds(tools::Instrument hand) const;
  bool tied() const;
  bool drawn() const;
  double turns() const;
  double throwScore() const;
  void beginThrow(const std::function<Eigen::Vector3d(double)>& ball);
  void expertThrow(float* action) const;
  kinematics::JointPositions moved(tools::Instrument hand, const kinematics::JointPositions& from,
                                   const float* action) const;
  double held() const;
  bool passed() const;
  double score() const;
  void take(const scene::StepReport& report);

  std::shared_ptr<const Task> task_;
  simulation::Stage stage_;
  scene::StepInput input_;
  scene::StepReport report_;
  State state_;
  Watch watch_;
  Painter painter_;
  std::vector<float> xyz_;
  std::vector<scene::ThreadView> threads_;
  std::vector<scene::NeedleView> needles_;
};

/// n environments of one task, stepped by a few threads; they share the Task's Model.
class Environments {
 public:
  /// @throws std::invalid_argument outside of 1 … 4096 environments
  Environments(const std::shared_ptr<const Task>& task, std::size_t count, int threads);
  std::size_t count() const { return all_.size(); }
  Environment& at(std::size_t i) { return *all_.at(i); }
  /// @param seeds one each  @param observations count × kObservationSize
  void reset(const std::uint64_t* seeds, float* observations);
  /// An environment whose episode is over is reset by its next step instead, with the next seed (its seed +
  /// count), and its reward is 0: the "next step" mode of Gymnasium 1.
  void step(const float* actions, float* observations, StepResult* results);
  /// Of all, one behind the other. @param rgb, depth as Environment::picture(), count times as much
  void pictures(int width, int height, std::uint8_t* rgb, float* depth);

 private:
  std::vector<std::unique_ptr<Environment>> all_;
  solver::Pool pool_;
};

}  // namespace vest::learning
