#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "vest_bringup/exercise/exercise.h"
#include "vest_bringup/simulation/stage.h"

namespace vest::exercise {

/// Why a result counts as practice, or does not count. Bits.
enum Flag : std::uint64_t {
  kAssisted = 1,     ///< parameters or topology were edited
  kRestored = 2,     ///< begun from a snapshot
  kImplausible = 4,  ///< faster than `least_s`
  kFault = 8,        ///< an object fell back to its last good state
  kPractice = 16,    ///< not at the pace of real time; told by who has the recording, not by the engine
};

/// Something that counted, in the order of its steps.
struct Moment {
  enum class Kind : std::uint64_t {
    PhaseBegun,
    PhaseEnded,
    Hint,
    GateBroken,
    ErrorMade,
    WrongTool,
    Finished
  };
  Kind kind = Kind::PhaseBegun;
  std::uint64_t step = 0;
  std::uint64_t index = 0;  ///< of the phase, gate or error; of the instrument with WrongTool
};
inline constexpr std::size_t kMostMoments = 256;

/// What the exercise came to, or stands at.
struct Result {
  struct ItemScore {
    double value = 0;   ///< unit of the metric; NaN: not known, which passes nothing
    double points = 0;  ///< 0 … 100
    bool passed = false;
  };
  std::string exercise, hash;
  double time = 0;          ///< s, since the first phase began; 0: it has not
  double error_points = 0;  ///< s
  /// FLS-like: 100 raw / (limit − proficient) with raw = limit − time − errors, at least 0, at most 100; 0
  /// where a required phase is missing.
  double total = 0;
  double quality = 0;  ///< 0 … 100, weighted mean of the items' points
  bool finished = false, passed = false;
  std::uint64_t flags = 0, input_hash = 0;
  std::vector<ItemScore> items;
  std::vector<std::uint64_t> errors;   ///< times that each was made
  std::vector<std::string> failed_by;  ///< names of phases, gates and items
  std::vector<Moment> moments;
};

/// Degrees of an angle by its cosine, without libm: Abramowitz & Stegun 4.4.46, error below 2e-6 degrees.
double degrees(double cosine);

/// As JSON with units; numbers with 17 digits: the same bits give the same text.
std::string toJson(const Exercise& exercise, const Result& result);
/// A number as a person reads it beside its unit: three significant digits, no finer than a hundredth of the
/// unit, no exponent; what is not finite is "-".
std::string readable(double value);
/// Words for bits of Flag.
std::vector<std::string> flagWords(std::uint64_t flags);
/// What a name of `failed_by` means, and what a moment was, for people.
std::string textOf(const Exercise& exercise, const std::string& name);
std::string describe(const Exercise& exercise, const Moment& moment);
/// One line for each thing that counted, for people.
std::string toText(const Exercise& exercise, const Result& result);

class Progress;

/// An exercise in a scene: looks at each step and judges. No ROS, no clock; after construction a step
/// allocates nothing and throws nothing.
class Engine {
 public:
  struct Model;    ///< const once built (src/exercise/engine_state.h)
  struct State;    ///< what evolves
  struct Scratch;  ///< no meaning between steps

  /// @throws std::invalid_argument naming the exercise's file and an object, role or instrument that the
  /// scene does not have
  Engine(const Exercise& exercise, const scene::World& world, const simulation::Stage& stage);
  ~Engine();

  void step(const scene::World& world, const scene::StepInput& input, const scene::StepReport& report);
  void reset();
  /// Everything that evolves, little-endian.
  void save(std::vector<std::uint8_t>& bytes) const;
  bool restore(const std::uint8_t* bytes, std::size_t count);
  /// The snapshot that was restored is where a recording begins, not a second try: the result is what it was.
  void goOn();

  Result result() const;
  bool finished() const;
  std::size_t phasesDone() const;  ///< or passed over: number of the phase that runs, from 0
  const Exercise& exercise() const;
  /// For one other thread, which may keep it longer than the engine. Before the first step.
  std::shared_ptr<Progress> progress();

 private:
  std::shared_ptr<const Model> model_;
  std::unique_ptr<State> state_;
  std::unique_ptr<Scratch> scratch_;
  std::shared_ptr<Progress> progress_;  ///< null: nobody asked
  std::uint64_t flags_restored_ = 0;    ///< as the snapshot had them
};

/// What a person is told while it runs.
struct Standing {
  std::string phase;       ///< its name; empty at the end
  std::size_t number = 0;  ///< of the phase, from 1
  std::string
      instruction;  ///< of the phase, its hint once that is due, what is said until it starts; or empty
  bool hint = false;
  std::array<double, 3> force{};  ///< N, on left, right, third: mean of 20 ms
};

/// How an exercise stands, for another thread: renewed every 50 steps, and when something counted.
class Progress {
 public:
  Progress(std::shared_ptr<const Engine::Model> model, const Engine::State& state);
  ~Progress();

  /// The stepping thread's.
  void show(const Engine::State& state);
  /// The other thread's: whether there is something new; what is asked below is of it.
  bool update();
  Result result() const;
  Standing standing() const;
  const Exercise& exercise() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// The engine as the last effect of a Trainer: what it sees and says is part of the session's State.
class ExerciseEffect : public simulation::Effect {
 public:
  ExerciseEffect(const Exercise& exercise, const scene::World& world, const simulation::Stage& stage)
      : engine_(exercise, world, stage) {}
  void step(const scene::World& world, const scene::StepInput& input, const scene::StepReport& report,
            simulation::Feedback& feedback) override {
    (void)feedback;
    engine_.step(world, input, report);
  }
  void reset() override { engine_.reset(); }
  void save(std::vector<std::uint8_t>& bytes) const override { engine_.save(bytes); }
  bool restore(const std::uint8_t* bytes, std::size_t count) override {
    return engine_.restore(bytes, count);
  }
  /// `exercise assisted` changes nothing: it tells the result that somebody helped (kAssisted), as any edit
  /// does.
  void edits(const scene::World&, std::vector<scene::EditableParameter>& out) const override {
    out.push_back({"exercise", "assisted", "", 0, 1});
  }
  Engine& engine() { return engine_; }

 private:
  Engine engine_;
};

/// Adds an exercise to a stage, before its first step. @throws as Engine
Engine& addExercise(const Exercise& exercise, simulation::Stage& stage);

}  // namespace vest::exercise
