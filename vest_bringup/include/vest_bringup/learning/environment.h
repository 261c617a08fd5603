#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "vest_bringup/learning/painter.h"
#include "vest_bringup/learning/task.h"
#include "vest_tissue/solver/pool.h"

namespace vest::learning {

/// Numbers of a task's observation, in order. Lengths in cm, angles in rad, forces in N, world frame.
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

/// One trainee before something that has a score: a task, or an exercise. Same seed and actions, same bits,
/// on one machine. Not thread-safe.
class Environment {
 public:
  /// Called before the tissue consumes an input and after the step; for recorders.
  using Watch = std::function<void(const scene::StepInput& input, const scene::StepReport& report)>;

  virtual ~Environment() = default;
  Environment(const Environment&) = delete;
  Environment& operator=(const Environment&) = delete;

  /// Begins an episode: goal and start of the tips follow from the seed.
  /// @param observation task().observationSize() numbers
  virtual void reset(std::uint64_t seed, float* observation) = 0;
  /// One action, task().actionSize() numbers, held over options.skip simulated steps. The joints go evenly to
  /// where it leads. @throws std::logic_error where the episode is over
  virtual StepResult step(const float* action, float* observation) = 0;
  /// What a script that sees the scene does here: task().actionSize() numbers.
  virtual void expert(float* action) const = 0;
  virtual void observe(float* observation) const = 0;
  virtual scene::ToolInput tool() const = 0;  ///< the (first) instrument as commanded now
  /// What the endoscope sees now. @param rgb, depth as Painter::begin()
  virtual void picture(int width, int height, std::uint8_t* rgb, float* depth) = 0;
  /// The exercise's result as it stands, as JSON; empty: a task has none.
  virtual std::string result() const { return {}; }

  /// Everything that evolves, the Trainer and its commands. Exact.
  void save(std::vector<std::uint8_t>& bytes);
  /// @throws std::invalid_argument naming what does not fit; nothing has changed then
  void restore(const std::vector<std::uint8_t>& bytes);

  const Task& task() const { return *task_; }
  scene::World& world() { return stage_.trainer->world(); }
  const scene::World& world() const { return stage_.trainer->world(); }
  virtual std::uint64_t steps() const = 0;  ///< actions of this episode
  virtual std::uint64_t seed() const = 0;
  virtual bool over() const = 0;  ///< terminated, truncated, or not begun
  void watch(Watch watch) { watch_ = std::move(watch); }

 protected:
  Environment(std::shared_ptr<const Task> task, int threads);

  /// What the environment itself keeps, as it lies: fields of 8 bytes alone.
  virtual std::pair<void*, std::size_t> state() = 0;
  /// Whether such bytes can be taken; null: they can, else what is wrong.
  virtual const char* refuse(const void* state) const = 0;
  virtual void restored() {}

  const kinematics::TrainerArm& arm(tools::Instrument hand) const { return task_->box.arm(hand); }
  double seconds(std::uint64_t actions) const;  ///< of so many actions
  /// Where the first five numbers of an action lead an instrument. @param jaw whether its jaw moves
  kinematics::JointPositions moved(tools::Instrument hand, const kinematics::JointPositions& from,
                                   const float* action, bool jaw) const;
  static kinematics::JointPositions between(const kinematics::JointPositions& a,
                                            const kinematics::JointPositions& b, double s);
  /// On where it is above 0.
  static bool on(float number);
  /// A fresh input of the next step.
  void beginStep();
  Eigen::Isometry3d camera(const kinematics::JointPositions& endoscope) const;
  void draw(const Eigen::Isometry3d& camera, const std::vector<scene::ToolInput>& tools, int width,
            int height, std::uint8_t* rgb, float* depth);

  std::shared_ptr<const Task> task_;
  simulation::Stage stage_;
  scene::StepInput input_;
  scene::StepReport report_;
  Watch watch_;

 private:
  void drawPools();

  Painter painter_;
  std::vector<float> xyz_;
  std::vector<scene::ThreadView> threads_;
  std::vector<scene::NeedleView> needles_;
};

/// Of a task, or of an exercise.
std::unique_ptr<Environment> makeEnvironment(const std::shared_ptr<const Task>& task, int threads = 1);

/// One hand, or both, before one of tasks().
class TaskEnvironment : public Environment {
 public:
  explicit TaskEnvironment(std::shared_ptr<const Task> task, int threads = 1);

  void reset(std::uint64_t seed, float* observation) override;
  StepResult step(const float* action, float* observation) override;
  void expert(float* action) const override;
  void observe(float* observation) const override;
  scene::ToolInput tool() const override;
  /// The endoscope moves in camera_follow alone.
  void picture(int width, int height, std::uint8_t* rgb, float* depth) override;
  std::uint64_t steps() const override { return state_.steps; }
  std::uint64_t seed() const override { return state_.seed; }
  bool over() const override { return state_.over != 0; }

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

  std::pair<void*, std::size_t> state() override { return {&state_, sizeof state_}; }
  const char* refuse(const void* state) const override;

  const kinematics::TrainerArm& arm() const { return task_->box.arm(task_->row.hand); }
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
  using Environment::camera;
  Eigen::Isometry3d camera() const;
  bool watched() const;
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
  double held() const;
  bool passed() const;
  double score() const;
  void take(const scene::StepReport& report);

  State state_;
};

/// n environments of one task, stepped by a few threads; they share the Task's Model.
class Environments {
 public:
  /// @throws std::invalid_argument outside of 1 … 4096 environments
  Environments(const std::shared_ptr<const Task>& task, std::size_t count, int threads);
  std::size_t count() const { return all_.size(); }
  Environment& at(std::size_t i) { return *all_.at(i); }
  /// @param seeds one each  @param observations count × task().observationSize()
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
