#pragma once

#include <array>
#include <memory>
#include <string>
#include <vector>

#include "vest_bringup/simulation/effect.h"
#include "vest_effects/bleeding/swab.h"
#include "vest_effects/fluid/step.h"
#include "vest_effects/lens/lens.h"
#include "vest_effects/smoke/smoke.h"
#include "vest_tissue/scene/ring.h"

/// What lies in the operating field beside tissue: fluid, smoke and the endoscope's lens.
namespace vest::simulation {

struct FieldOptions {
  fluid::Parameters fluid;
  smoke::Parameters smoke;
  lens::Parameters lens;
  double irrigation_flow =
      5e-5;                   ///< m³/s: 3 l/min, the greatest of Aesculap's irrigator; at full bag pressure
  double bag_pressure = 4e4;  ///< Pa: 300 mmHg, where the cuffs of infusion bags are filled to (assumed)
  double irrigation_diameter = 0.005;  ///< m, of the same
  double suction_flow = 5e-5;          ///< m³/s of liquid; assumed as irrigation
  double suction_gas_flow = 1.7e-4;    ///< m³/s of gas at a tip that draws no liquid: 10 l/min; assumed
  int threads = 1;
};

/// Each number of the options by the name that sessions and scripts know, with what is allowed (unit of the
/// field). @param number called as number(name, double& value, lowest, highest)
template <class Number>
void eachNumber(FieldOptions& o, Number&& number) {
  number("fluid/spacing", o.fluid.spacing, 0.0005, 0.01);
  number("fluid/pool_cell", o.fluid.pool_cell, 0.001, 0.05);
  number("fluid/restitution", o.fluid.restitution, 0, 1);
  number("fluid/friction", o.fluid.friction, 0, 1);
  number("fluid/water_viscosity", o.fluid.water_viscosity, 0, 1);
  number("fluid/blood_viscosity", o.fluid.blood_viscosity, 0, 1);
  number("fluid/irrigation_flow", o.irrigation_flow, 0, 5e-4);
  number("fluid/bag_pressure", o.bag_pressure, 0, 6e4);
  number("fluid/irrigation_diameter", o.irrigation_diameter, 0.0005, 0.02);
  number("fluid/suction_flow", o.suction_flow, 0, 5e-4);
  number("fluid/suction_gas_flow", o.suction_gas_flow, 0, 5e-3);
  number("smoke/cell", o.smoke.cell, 0.005, 0.1);
  number("smoke/yield", o.smoke.yield, 0, 1e-4);
  number("smoke/settling", o.smoke.settling, 0.1, 1e9);
  number("lens/start_temperature", o.lens.start_temperature, 250, 318.15);
  number("lens/outside_temperature", o.lens.outside_temperature, 250, 330);
  number("lens/warming", o.lens.warming, 0, 1e5);
}

/// What one moment of the field shows, for publishing.
struct FieldFrame {
  std::uint64_t step = 0;
  std::int64_t steady_ns = 0;
  std::shared_ptr<const fluid::Model> fluid_model;
  std::shared_ptr<const smoke::Model> smoke_model;
  std::shared_ptr<const std::vector<std::string>> objects;  ///< names, scene order
  fluid::State fluid;        ///< without its knots and what of particles and pools no message tells
  std::vector<float> smoke;  ///< kg/m³, as drawn
  std::array<smoke::Puff, smoke::kMostPuffs> puffs{};
  std::uint32_t puff_count = 0;
  double smoke_mass = 0;  ///< kg
  lens::State lens;
  double humidity = 0;  ///< relative, of the cavity's gas
  double fog = 0;
  std::array<float, lens::kColumns * lens::kRows> fogging{};  ///< 0 … 1
  std::array<double, tools::kInstrumentCount> clogged{};      ///< 0 … 1: of each sucker's bore
  std::array<bleeding::Swab, tools::kInstrumentCount> swabs{};
  bool degraded = false;                    ///< at any step since the last frame
  std::vector<scene::ImpactInput> impacts;  ///< since the last frame, at most kMostFrameImpacts
  std::uint64_t impacts_dropped = 0;
  std::uint64_t refused = 0;  ///< steps whose input was absurd and that were left out
};
inline constexpr std::size_t kMostFrameImpacts = 2048;
using FieldFrames = scene::TripleBuffer<FieldFrame>;

/// Fluid at 250 Hz, smoke and lens at 50 Hz of simulated time, in lockstep with the tissue.
///
/// Instruments: a suction-irrigator irrigates and sucks as its functions say; its two trumpet valves take a
/// moment to open and to close, and the bag's pressure drives the water against that of the gas. Tissue on
/// its mouth leaves the side holes to draw; clots stay in the bore until water drives them out. A swab soaks
/// up drops and pools that it lies in until it is full; the next one that is taken is dry. Where nobody holds
/// one, an endoscope that irrigates rinses its lens. The lens is cleaned and warmed while the endoscope is
/// drawn back into its trocar, and wiped where it touches tissue. Parameter edits: object `fluid`:
/// irrigation_flow, suction_flow (m³/s), bag_pressure (Pa); `smoke`: yield (kg/J); `lens`: warming, rinse (0
/// or 1), temperature (K of the lens). The cavity's gas: Feedback::gas.
class OperatingField : public Effect {
 public:
  /// @param frames where to put what is to be shown, of this object alone, or null. @throws
  /// std::invalid_argument
  /// @param films whether a SurfaceEffect takes Feedback::films
  OperatingField(const scene::World& world, const FieldOptions& options, std::shared_ptr<FieldFrames> frames,
                 bool films = false);
  ~OperatingField() override;

  /// Share of a sucker, 0 … 1, that tissue on its mouth and clots in its bore leave open.
  double suctionOpen(const scene::World& world, std::size_t tool) const;
  /// How much of the sight condensate takes, 0 … 1.
  double fog() const;
  /// What an instrument's swab holds; nothing where it is none.
  const bleeding::Swab& swab(std::size_t tool) const;

  Ports ports() const override {
    return {kGas | kSources | kLensBlood | kClots | kWiped, 0, kFilms | kGasDrawn | kSwabs};
  }
  void step(const scene::World& world, const scene::StepInput& input, const scene::StepReport& report,
            Feedback& feedback) override;
  void edits(const scene::World& world, std::vector<scene::EditableParameter>& out) const override;
  void reset() override;
  /// Liquid, smoke and lens go on: their places are the world's, and tissue is looked for again.
  void adopt(const Effect& before, const std::vector<std::uint32_t>& objects) override;
  void save(std::vector<std::uint8_t>& bytes) const override;
  bool restore(const std::uint8_t* bytes, std::size_t count) override;

  const fluid::Model& fluidModel() const;
  const fluid::State& fluid() const;
  const smoke::Model& smokeModel() const;
  const smoke::State& smoke() const;
  const lens::State& lens() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace vest::simulation
