#pragma once

#include "vest_bringup/simulation/effect.h"
#include "vest_effects/gas/gas.h"
#include "vest_tissue/scene/ring.h"

namespace vest::simulation {

/// What the insufflator's display shows.
struct GasFrame {
  std::uint64_t step = 0;
  double set_pressure = 0;  ///< Pa
  double suction = 0;       ///< m³/s of gas
  double supplied = 0;      ///< m³ since the start, as insufflators count
  gas::Condition now;
};

/// The pneumoperitoneum at 50 Hz of simulated time. First of the effects: its Feedback::gas is for all behind
/// it. Takes Feedback::gas_drawn of the step before.
/// Parameter edits: object `gas`: set_pressure (Pa), max_flow (m³/s), leak_area (m²: a trocar's open valve
/// has about 1e-5).
class GasEffect : public Effect {
 public:
  /// @param frames may be null  @throws std::invalid_argument
  GasEffect(const gas::Parameters& parameters, scene::TripleBuffer<GasFrame>* frames);

  Ports ports() const override { return {0, kGasDrawn, kGas}; }
  void step(const scene::World& world, const scene::StepInput& input, const scene::StepReport& report,
            Feedback& feedback) override;
  void edits(const scene::World& world, std::vector<scene::EditableParameter>& out) const override;
  void adopt(const Effect& before, const std::vector<std::uint32_t>& objects) override;
  void reset() override;
  void save(std::vector<std::uint8_t>& bytes) const override;
  bool restore(const std::uint8_t* bytes, std::size_t count) override;

  const gas::State& state() const { return state_; }
  gas::Condition now() const { return now_; }

 private:
  gas::Parameters options_;   ///< of the session
  gas::Parameters settings_;  ///< what edits made of them
  gas::State state_;
  gas::Condition now_;  ///< of state_
  scene::TripleBuffer<GasFrame>* frames_;
};

}  // namespace vest::simulation
