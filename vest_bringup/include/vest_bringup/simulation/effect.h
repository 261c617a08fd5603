#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "vest_effects/bleeding/source.h"
#include "vest_tissue/scene/edits.h"
#include "vest_tissue/scene/world.h"

namespace vest::simulation {

/// What a fluid does to the film of blood on a contact triangle.
struct FilmInput {
  std::uint16_t object = 0;
  std::uint32_t triangle = 0;
  double impulse = 0;  ///< N·s: shear stress times area times time (fluid::Shear)
  double blood = 0;    ///< m³ that stays there
};

/// The cavity's gas, for the effects that stand in it; without a GasEffect as it stands here.
struct CavityGas {
  double pressure = 0;                           ///< Pa above the air outside
  double temperature = 310.15, humidity = 0.95;  ///< K; relative, 0 … 1
  double renewal = 0;    ///< 1/s: share of the gas that leaves by leaks and absorption
  double sunk = 0;       ///< m: of the wall's highest place; the tissue's next step meets it there
  double drying = 8e-9;  ///< m/s of water that leaves a wet surface: of that humidity, by gas::condition()
};

/// What effects hand on. Arrays have room: nothing allocates while it lasts; what does not fit is counted.
struct Feedback {
  // To the tissue: the next step consumes it (fixed lag: one step). Recorded with that step's input.
  std::vector<scene::ImpactInput> impacts;
  std::vector<scene::KnotLoad> loads;  ///< with load_over, as scene::StepInput says
  double load_over = 0;                ///< s
  std::vector<scene::DilatationInput> dilatations;
  // To the effects behind this one, in the same step.
  std::vector<bleeding::FluidSource> sources;
  CavityGas gas;
  std::array<double, tools::kInstrumentCount> clots{};  ///< m³ of clot that each sucker took
  float blood_at_lens = 0;  ///< 0 … 1: how far the tissue that the endoscope touches is covered with blood
  /// From the field to the surfaces, which take it in the next step (fixed lag) and empty it.
  std::vector<FilmInput> films;
  /// m³/s of gas that suction draws: from the field to the gas, which takes it in the next step (fixed lag).
  double gas_drawn = 0;
  /// m³ that each swab can still hold: from the field to the surfaces, which take it in the next step (fixed
  /// lag); and what they then wiped into it, in the same step.
  std::array<double, tools::kInstrumentCount> swab_room{}, wiped{};
};

/// What passes between effects in Feedback and beside it.
enum Port : unsigned {
  kGas = 1,        ///< Feedback::gas
  kSources = 2,    ///< Feedback::sources
  kLensBlood = 4,  ///< Feedback::blood_at_lens
  kFilms = 8,      ///< Feedback::films
  kGasDrawn = 16,  ///< Feedback::gas_drawn
  kSupply = 32,    ///< flow into tissue and pressure of the BloodEffect, which a SurfaceEffect reads
  kSeeped = 64,    ///< BloodEffect::lose
  kClots = 128,    ///< Feedback::clots
  kSwabs = 256,    ///< Feedback::swab_room
  kWiped = 512,    ///< Feedback::wiped
};
/// Trainer::add holds an effect to them.
struct Ports {
  unsigned takes = 0;       ///< of this step: whoever gives it stands before
  unsigned takes_late = 0;  ///< of the last step: whoever gives it stands behind
  unsigned gives = 0;
};

/// A member of the composite beside the tissue (haemodynamics and bleeding, fluid, smoke, lens).
class Effect {
 public:
  virtual ~Effect() = default;
  virtual Ports ports() const { return {}; }
  /// One step after the tissue's. Real-time safe; appends to `feedback`, whose arrays have room. Reads
  /// nothing but its arguments and its own State: the same inputs give the same bits.
  virtual void step(const scene::World& world, const scene::StepInput& input, const scene::StepReport& report,
                    Feedback& feedback) = 0;
  /// Appends the parameters that a step's edits may change here. Before the first step.
  virtual void edits(const scene::World& world, std::vector<scene::EditableParameter>& out) const {
    (void)world, (void)out;
  }
  /// In a scene that was edited: goes on where `before`, made for the scene until then, is; where it cannot,
  /// it stays as it was made. @param objects as World::adopt
  virtual void adopt(const Effect& before, const std::vector<std::uint32_t>& objects) {
    (void)before, (void)objects;
  }
  /// As the scene was loaded.
  virtual void reset() = 0;
  /// Appends everything that evolves, little-endian. One that appends nothing begins anew after a restore.
  virtual void save(std::vector<std::uint8_t>& bytes) const { (void)bytes; }
  /// Takes what save() appended. False, and nothing has changed, where the bytes are not its own.
  virtual bool restore(const std::uint8_t* bytes, std::size_t count) {
    (void)bytes;
    if (count == 0) reset();
    return count == 0;
  }
};

}  // namespace vest::simulation
