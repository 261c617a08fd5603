#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "vest_tissue/scene/runner.h"

namespace vest::session {

/// Steps a simulation through recorded inputs and compares what comes of it with what was recorded.
class Resimulation {
 public:
  /// @param effects the simulation has the effects of the session: they make their feedback (impacts, loads,
  /// dilatations) again, and it is compared with the recorded one. Without them the recorded one is consumed.
  explicit Resimulation(std::unique_ptr<scene::Simulation> simulation, bool effects = false);

  /// Goes on in another scene.
  void load(std::unique_ptr<scene::Simulation> simulation) { simulation_ = std::move(simulation); }
  /// Goes on in a scene that was edited: what is the same in both keeps its State.
  void adopt(std::unique_ptr<scene::Simulation> simulation) {
    simulation->adopt(*simulation_);
    simulation_ = std::move(simulation);
  }
  /// Begins at a snapshot instead of the scene. @throws std::invalid_argument naming what does not fit
  void begin(const std::vector<std::uint8_t>& snapshot);

  /// What a step did; the first that holds.
  enum class Outcome {
    Same,      ///< as recorded, as far as its input tells
    Missing,   ///< there is a step missing before it; nothing moved
    Feedback,  ///< the effects handed other feedback to this step than they did in the session
    Fault,     ///< FAULT, which the session did not have in this step
    NoFault    ///< no FAULT, which the session had
  };
  /// @param reset resets first  @param jumps the step's number starts anew  @param fault the session had a
  /// FAULT in this step
  Outcome step(const scene::StepInput& input, bool reset, bool jumps, bool fault = false);

  /// Whether the State has the recorded hash, and the effects, where they are re-simulated, have theirs.
  bool compare(std::uint64_t recorded);
  bool compareEffects(std::uint64_t recorded);

  const scene::World& world() const { return simulation_->world(); }
  scene::Simulation& simulation() { return *simulation_; }
  /// Of the last step: what it consumed, what came of it.
  const scene::StepInput& input() const { return input_; }
  const scene::StepReport& report() const { return report_; }
  std::uint64_t steps() const { return steps_; }
  std::uint64_t compared() const { return compared_; }  ///< hashes of the State
  std::uint64_t comparedEffects() const { return compared_effects_; }
  std::uint64_t faults() const { return faults_; }  ///< steps, as recorded

 private:
  std::unique_ptr<scene::Simulation> simulation_;
  bool effects_;
  scene::StepReport report_;
  scene::StepInput input_;
  std::uint64_t steps_ = 0, compared_ = 0, compared_effects_ = 0, faults_ = 0;
};

}  // namespace vest::session
