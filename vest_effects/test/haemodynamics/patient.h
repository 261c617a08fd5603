#pragma once

#include <gtest/gtest.h>

#include "vest_effects/haemodynamics/circulation.h"

/// A patient of the shipped database: bled, drugged, asleep.
namespace vest::haemodynamics {

inline const Circulation& pelvis() {
  static const Circulation built = buildCirculation(readVessels(VEST_VESSEL_DATA "/pelvis"), 0.006);
  return built;
}

struct Patient {
  CirculationState state = pelvis().rest;
  CirculationInputs inputs;
  CirculationScratch scratch{pelvis().model};
  void seconds(double t) {
    for (int i = 0; i < static_cast<int>(t * 1000 + 0.5); ++i)
      ASSERT_EQ(step(pelvis().model, inputs, 1e-3, state, scratch), Status::kOk);
  }
  /// The same without the pulse: minutes in a moment.
  void contents(double t) {
    for (int i = 0; i < static_cast<int>(t * 100 + 0.5); ++i)
      stepContents(pelvis().model, inputs.settings, 0.01, state);
  }
  /// t s with the drugs, of which the pulse and the reflex see the last 40.
  void drugged(double t) { contents(t - 40), seconds(40); }
  bool give(DrugIndex drug, double amount) {
    return haemodynamics::give(drug, amount, inputs.settings, state);
  }
  double mean() const { return state.mean / 133.322; }  // mmHg
  double output() const { return 6e4 * state.output; }  // l/min
  /// Loses a share of the blood volume at an even pace, then waits for the reflex.
  void bleed(double share, double wait) {
    const double volume = share * pelvis().model.vessels.control.blood_volume;
    for (int i = 0; i < 100; ++i) {
      state.lost += volume / 100;
      seconds(0.1);
    }
    seconds(wait);
  }
};

/// Anaesthesia: a fifth of the reflex is left (tuned: drugs.h), arterioles are wide; veins, too, as if a
/// share of the blood were lost.
inline Patient asleep(double share) {
  Patient p;
  p.inputs.settings.reflex_scale = 0.2;
  p.inputs.settings.resistance_scale = 0.6;
  p.bleed(share, 40);
  return p;
}

inline int vessel(const char* name) {
  const int i = pelvis().model.find(name);
  EXPECT_GE(i, 0) << name;
  return i;
}

}  // namespace vest::haemodynamics
