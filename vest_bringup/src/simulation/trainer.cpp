#include "vest_bringup/simulation/trainer.h"

namespace vest::simulation {

Trainer::Trainer(scene::World world) : world_(std::move(world)) {
  feedback_.impacts.reserve(1024);
  feedback_.dilatations.reserve(256);
  feedback_.sources.reserve(bleeding::kMostSources);
}

void Trainer::add(std::unique_ptr<Effect> effect) {
  effects_.push_back(std::move(effect));
}

scene::Status Trainer::step(scene::StepInput& input, scene::StepReport& report) {
  input.impacts.insert(input.impacts.end(), feedback_.impacts.begin(), feedback_.impacts.end());
  input.dilatations.insert(input.dilatations.end(), feedback_.dilatations.begin(),
                           feedback_.dilatations.end());
  const scene::Status status = world_.step(input, report);
  clearFeedback();
  for (const auto& effect : effects_) effect->step(world_, input, report, feedback_);
  return status;
}

void Trainer::reset() {
  world_.reset();
  restored();
}

void Trainer::restored() {
  clearFeedback();
  for (const auto& effect : effects_) effect->reset();
}

void Trainer::clearFeedback() {
  feedback_.impacts.clear();
  feedback_.dilatations.clear();
  feedback_.sources.clear();
}

}  // namespace vest::simulation
