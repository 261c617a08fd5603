#pragma once

#include "vest_bringup/exercise/engine.h"
#include "vest_bringup/learning/environment.h"

namespace vest::learning {

/// An exercise in lockstep: its tools, its scene with all effects, its limits. Its instruments and the
/// endoscope act. The score is the share of its phases that are done, weighed by the marks of its score
/// items:
///   s = done / phases · (1 + quality / 100) / 2; failed: 0.
/// An episode ends when the exercise does. Names and units of the observation: Task::names.
class ExerciseEnvironment : public Environment {
 public:
  ExerciseEnvironment(std::shared_ptr<const Task> task, int threads);

  void reset(std::uint64_t seed, float* observation) override;
  StepResult step(const float* action, float* observation) override;
  /// Follows the script that passes, by time; functions and exchange of tools with it.
  void expert(float* action) const override;
  void observe(float* observation) const override;
  scene::ToolInput tool() const override { return tool(task_->hands.front()); }
  void picture(int width, int height, std::uint8_t* rgb, float* depth) override;
  std::string result() const override;
  std::uint64_t steps() const override { return state_.steps; }
  std::uint64_t seed() const override { return state_.seed; }
  bool over() const override { return state_.over != 0; }

 private:
  // Fields of 8 bytes alone: no padding, saved as they lie.
  struct Hand {
    kinematics::JointPositions joints{};
    std::array<double, 3> force{};  ///< N
    double pinch = 0;               ///< N
    std::uint64_t holds = 0, tool = 0, next = 0,
                  was_open = 0;  ///< tool: place among the exercise's; next: asked
  };
  struct State {
    std::uint64_t seed = 0, steps = 0, over = 1;
    double score = 0, quality = 0;  ///< 0 … 1
    std::array<Hand, tools::kInstrumentCount> hands{};
  };
  static_assert(sizeof(State) ==
                5 * 8 + tools::kInstrumentCount * (sizeof(kinematics::JointPositions) + 8 * 8));

  std::pair<void*, std::size_t> state() override { return {&state_, sizeof state_}; }
  const char* refuse(const void* state) const override;
  void restored() override { engine_->goOn(); }

  tools::ToolKind kind(tools::Instrument hand) const;
  scene::ToolInput tool(tools::Instrument hand) const;
  /// Takes quality and score of what the engine says.
  void take(const exercise::Result& now);

  exercise::Engine* engine_;
  State state_;
};

}  // namespace vest::learning
