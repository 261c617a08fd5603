#include "vest_bringup/simulation/gas_effect.h"

#include <algorithm>
#include <cmath>

#include "vest_effects/state_bytes.h"

namespace vest::simulation {
namespace {

constexpr std::uint64_t kGasEvery = 20, kGasFrameEvery = 100;  ///< steps of the tissue

/// visit(parameter, unit, number, lowest, highest)
template <class P, class Visit>
void eachEdit(P& p, Visit&& visit) {
  visit("set_pressure", "Pa", p.set_pressure, 0.0, 4000.0);
  visit("max_flow", "m³/s", p.max_flow, 0.0, 1e-3);
  visit("leak_area", "m²", p.leak_area, 0.0, 1e-4);
}

}  // namespace

GasEffect::GasEffect(const gas::Parameters& parameters, scene::TripleBuffer<GasFrame>* frames)
    : options_(parameters), frames_(frames) {
  gas::check(options_);
  reset();
}

void GasEffect::step(const scene::World& world, const scene::StepInput& input, const scene::StepReport&,
                     Feedback& feedback) {
  for (const auto& e : input.edits) {
    if (e.object != "gas" || !std::isfinite(e.value)) continue;
    eachEdit(settings_, [&](const char* parameter, const char*, double& to, double low, double high) {
      if (e.parameter == parameter) to = std::clamp(e.value, low, high);
    });
  }
  const double drawn = std::clamp(feedback.gas_drawn, 0.0, 0.01);
  if (world.steps() % kGasEvery == 0) {
    gas::Inputs in;
    in.dt = std::min(0.1, input.dt * kGasEvery);
    in.suction = drawn;
    gas::step(settings_, in, state_);
    now_ = gas::condition(settings_, state_);
  }
  feedback.gas = {now_.pressure, now_.temperature,         now_.humidity,
                  now_.renewal,  std::min(now_.sunk, 1.0), now_.drying};
  if (!frames_ || world.steps() % kGasFrameEvery != 0) return;
  GasFrame& f = frames_->back();
  f.step = world.steps();
  f.set_pressure = settings_.set_pressure, f.suction = drawn;
  f.supplied = gas::counted(state_.supplied);
  f.now = now_;
  frames_->publish();
}

void GasEffect::edits(const scene::World&, std::vector<scene::EditableParameter>& out) const {
  eachEdit(settings_, [&](const char* parameter, const char* unit, double, double low, double high) {
    out.push_back({"gas", parameter, unit, low, high});
  });
}

void GasEffect::reset() {
  settings_ = options_;
  state_ = gas::initialState(settings_);
  now_ = gas::condition(settings_, state_);
}

void GasEffect::adopt(const Effect& before, const std::vector<std::uint32_t>&) {
  const auto* const gas = dynamic_cast<const GasEffect*>(&before);
  if (gas != nullptr) settings_ = gas->settings_, state_ = gas->state_, now_ = gas->now_;
}

void GasEffect::save(std::vector<std::uint8_t>& bytes) const {
  effects::StateWriter writer(bytes);
  eachEdit(settings_, [&](const char*, const char*, double value, double, double) { writer(value); });
  gas::save(state_, bytes);
}

bool GasEffect::restore(const std::uint8_t* bytes, std::size_t count) {
  gas::Parameters settings = options_;
  constexpr std::size_t kSettings = 3 * sizeof(double);
  effects::StateReader reader(bytes, std::min(count, kSettings));
  bool good = true;
  eachEdit(settings, [&](const char*, const char*, double& value, double low, double high) {
    reader(value);
    good = good && value >= low && value <= high;
  });
  if (!reader.done() || !good || !gas::restore(bytes + kSettings, count - kSettings, state_)) return false;
  settings_ = settings;
  now_ = gas::condition(settings_, state_);
  return true;
}

}  // namespace vest::simulation
