#pragma once

#include <memory>
#include <vector>

#include "vest_tissue/scene/runner.h"

/// The ROS-free composite: instruments' input, tissue and effects in lockstep.
namespace vest::simulation {

/// What effects hand back to the tissue; the next step consumes it (fixed lag: one step).
struct Feedback {
  std::vector<scene::ImpactInput> impacts;
  std::vector<scene::DilatationInput> dilatations;
};

/// A member of the composite beside the tissue (haemodynamics, bleeding, fluid, smoke …).
class Effect {
 public:
  virtual ~Effect() = default;
  /// One step after the tissue's. Real-time safe; appends to `feedback`, whose arrays have room.
  virtual void step(const scene::World& world, const scene::StepInput& input, const scene::StepReport& report,
                    Feedback& feedback) = 0;
  virtual void reset() = 0;
};

///   input (+ feedback of the step before) -> tissue -> effects -> feedback for the next step
class Trainer : public scene::Simulation {
 public:
  explicit Trainer(scene::World world);

  /// Before the first step. Effects are stepped in the order in which they were added.
  void add(std::unique_ptr<Effect> effect);

  scene::Status step(scene::StepInput& input, scene::StepReport& report) override;
  scene::World& world() override { return world_; }
  void reset() override;
  void restored() override;

 private:
  void clearFeedback();

  scene::World world_;
  std::vector<std::unique_ptr<Effect>> effects_;
  Feedback feedback_;
};

}  // namespace vest::simulation
