#pragma once

#include <memory>
#include <vector>

#include "vest_bringup/simulation/effect.h"
#include "vest_tissue/scene/runner.h"

/// The ROS-free composite: instruments' input, tissue and effects in lockstep.
namespace vest::simulation {

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
