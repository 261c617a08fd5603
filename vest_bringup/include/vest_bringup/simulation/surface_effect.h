#pragma once

#include <cstdint>
#include <vector>

#include "vest_bringup/simulation/blood_effect.h"
#include "vest_bringup/simulation/supply_map.h"
#include "vest_effects/bleeding/perfusion.h"
#include "vest_effects/bleeding/surface.h"

namespace vest::simulation {

struct SurfaceOptions {
  double scale = 1;        ///< no unit, factor on what seeps, for teaching: 0 … 1000
  double frame_rate = 10;  ///< Hz of simulated time, 1 … 100
};

/// Fields per knot of all objects, in the order of TissueState.
struct SurfaceFrame {
  std::uint64_t step = 0;
  std::uint32_t revision = 0;   ///< of the world that the knots belong to
  std::vector<float> flow;      ///< m³/s
  std::vector<float> wetness;   ///< 0 dry … 1 covered with blood
  std::vector<float> supply;    ///< 0 … 1: what its vessels bring here, over that at rest
  std::vector<float> oxygen;    ///< 0 … 1: saturation of the blood in it (bleeding/perfusion.h)
  std::vector<float> set;       ///< 0 fresh … 1 set: its film
  double seeped = 0, film = 0;  ///< m³ since the start; on the surfaces now
  double wiped = 0;             ///< m³ since the start, into swabs
};

/// Blood on the surfaces of all objects. Tissue that is no vessel seeps where it was cut: opened by events
/// (cut, torn, perforated, punctured) and, in finite elements, by the faces that a cut made; closed by what a
/// needle injects, by coagulation's energy and by a tool that presses. It seeps and looks as its own blood
/// supply goes: by the vessels of its object, and not at all where it was cut or tied off. Films come from
/// there and from
/// Feedback::films, which also washes them; swabs that touch wipe them up. What drips is a fluid source.
/// Every eighth step. Parameter edit (object empty): surface_bleeding (the scale).
class SurfaceEffect : public Effect {
 public:
  /// @param blood the circulation that gives the pressure and loses the blood; may be null; outlives this
  SurfaceEffect(const scene::World& world, const SurfaceOptions& options, BloodEffect* blood,
                scene::TripleBuffer<SurfaceFrame>* frames);

  Ports ports() const override {
    return {kSupply | kGas, kFilms | kSwabs, kSources | kLensBlood | kSeeped | kClots | kWiped};
  }
  void step(const scene::World& world, const scene::StepInput& input, const scene::StepReport& report,
            Feedback& feedback) override;
  void edits(const scene::World& world, std::vector<scene::EditableParameter>& out) const override;
  void reset() override;
  /// Of objects that are kept all goes on; films of the others are gone, and counted as wiped.
  void adopt(const Effect& before, const std::vector<std::uint32_t>& objects) override;
  void save(std::vector<std::uint8_t>& bytes) const override;
  bool restore(const std::uint8_t* bytes, std::size_t count) override;

  const bleeding::SurfaceState& state() const { return state_; }
  const bleeding::SurfaceModel& model() const { return model_; }
  const bleeding::PerfusionState& perfusion() const { return perfusion_; }

 private:
  template <class Archive, class S, class P, class M>
  static void walk(Archive& archive, S& state, P& perfusion, M& supply, double& scale) {
    archive(perfusion.reach), archive(perfusion.saturation), archive(perfusion.dilation);
    archive(supply.fed), archive(supply.seen);
    archive(state.open), archive(state.clot), archive(state.drug), archive(state.styptic),
        archive(state.sealed), archive(state.area), archive(state.film), archive(state.age),
        archive(state.loose), archive(state.flow);
    archive(state.injected), archive(state.depot);
    for (auto& drip : state.drips) archive(drip.object), archive(drip.knot), archive(drip.idle);
    archive(state.used), archive(state.seeped), archive(state.stained), archive(state.shed),
        archive(state.wiped), archive(state.active), archive(scale);
  }
  /// Copies that cuts have made since, and the faces that they opened.
  void followCuts(const scene::World& world);
  void findPositions(const scene::World& world, std::size_t object);
  void take(const scene::World& world, const scene::Event& event);
  void takeFilms(const scene::World& world, std::vector<FilmInput>& films);
  void useTools(const scene::World& world, const scene::StepInput& input, const scene::StepReport& report,
                const std::array<double, tools::kInstrumentCount>& swab_room);
  double perfused(std::size_t object) const;
  void stepPerfusion(const scene::World& world, double dt);
  float bloodAt(const scene::World& world, tools::Instrument tool) const;
  void tellFrame(const scene::World& world);

  SurfaceOptions options_;
  BloodEffect* blood_;
  bleeding::SurfaceModel model_;
  bleeding::SurfaceState state_;
  bleeding::PerfusionState perfusion_;
  SupplyMap supply_;
  double scale_ = 1;
  std::vector<std::vector<float>> positions_, rest_;  ///< m, per object, room for copies
  std::vector<bleeding::SurfaceMesh> meshes_;
  std::vector<int> territory_;              ///< per object: of the vessels' database; -1: none
  std::vector<double> perfused_, drained_;  ///< per object: by its arteries, by its veins
  std::vector<std::uint32_t> seen_;  ///< per object: revision of its topology that areas were measured at
  std::vector<std::uint32_t> faces_, at_start_;  ///< per object: contact triangles that were seen; evolves
  bleeding::SurfaceRunoff runoff_{model_};
  bleeding::SurfaceInputs inputs_;
  double sunk_ = 0;                  ///< m: of the cavity's wall in this step
  std::vector<std::uint8_t> hangs_;  ///< per object: positions_ are those of a wall that hangs
  scene::TripleBuffer<SurfaceFrame>* frames_;
  std::uint64_t frame_every_ = 100;
};

}  // namespace vest::simulation
