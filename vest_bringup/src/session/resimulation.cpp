#include "vest_bringup/session/resimulation.h"

#include <algorithm>

#include "vest_bringup/simulation/trainer.h"

namespace vest::session {
namespace {

/// To the bit: what was recorded came from the same arithmetic.
bool sameFeedback(const scene::StepInput& a, const scene::StepInput& b) {
  const auto impact = [](const scene::ImpactInput& x, const scene::ImpactInput& y) {
    return x.object == y.object && x.triangle == y.triangle && x.weights == y.weights &&
           x.momentum == y.momentum;
  };
  const auto load = [](const scene::KnotLoad& x, const scene::KnotLoad& y) {
    return x.object == y.object && x.knot == y.knot && x.force == y.force && x.damping == y.damping;
  };
  const auto dilatation = [](const scene::DilatationInput& x, const scene::DilatationInput& y) {
    return x.vessel_segment == y.vessel_segment && x.dilatation == y.dilatation;
  };
  return a.load_over == b.load_over && a.sunk == b.sunk &&
         std::equal(a.impacts.begin(), a.impacts.end(), b.impacts.begin(), b.impacts.end(), impact) &&
         std::equal(a.loads.begin(), a.loads.end(), b.loads.begin(), b.loads.end(), load) &&
         std::equal(a.dilatations.begin(), a.dilatations.end(), b.dilatations.begin(), b.dilatations.end(),
                    dilatation);
}

}  // namespace

Resimulation::Resimulation(std::unique_ptr<scene::Simulation> simulation, bool effects)
    : simulation_(std::move(simulation)), effects_(effects) {}

void Resimulation::begin(const std::vector<std::uint8_t>& snapshot) {
  if (effects_) return simulation_->restore(snapshot);
  const auto world = static_cast<std::ptrdiff_t>(simulation::worldBytes(snapshot));
  simulation_->world().restore(std::vector<std::uint8_t>(snapshot.begin(), snapshot.begin() + world));
}

Resimulation::Outcome Resimulation::step(const scene::StepInput& input, bool reset, bool jumps, bool fault) {
  if (reset) simulation_->reset();
  if (input.step != world().steps() + 1 && !jumps) return Outcome::Missing;
  input_ = input;
  if (effects_) {
    input_.impacts.clear();
    input_.loads.clear();
    input_.load_over = 0;
    input_.dilatations.clear();
  }
  const bool faulted = simulation_->step(input_, report_) == scene::Status::Fault;
  ++steps_;
  if (effects_ && !sameFeedback(input_, input)) return Outcome::Feedback;
  if (faulted != fault) return faulted ? Outcome::Fault : Outcome::NoFault;
  faults_ += faulted ? 1 : 0;
  return Outcome::Same;
}

bool Resimulation::compare(std::uint64_t recorded) {
  ++compared_;
  return world().stateHash() == recorded;
}

bool Resimulation::compareEffects(std::uint64_t recorded) {
  if (!effects_) return true;
  ++compared_effects_;
  return simulation_->effectsHash() == recorded;
}

}  // namespace vest::session
