#pragma once

#include <cstdint>
#include <vector>

#include "vest_bringup/simulation/blood_effect.h"
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
  double seeped = 0, film = 0;  ///< m³ since the start; on the surfaces now
};

/// Organ surfaces that seep where they were cut. Opened by events (cut, torn, perforated, punctured) of
/// objects that are no vessels; closed by an injection needle that fires in tissue, by coagulation's energy
/// and by a tool that presses; washed by whatever flows over them. What runs off is a fluid source. Parameter
/// edit (object empty): surface_bleeding (the scale).
class SurfaceEffect : public Effect {
 public:
  /// @param blood the circulation that gives the pressure and loses the blood; may be null; outlives this
  SurfaceEffect(const scene::World& world, const SurfaceOptions& options, BloodEffect* blood,
                scene::TripleBuffer<SurfaceFrame>* frames);

  void step(const scene::World& world, const scene::StepInput& input, const scene::StepReport& report,
            Feedback& feedback) override;
  /// Water flows over a triangle of an object's contact surface. @param impulse N·s, fluid::Shear
  void wash(std::size_t object, const std::array<std::uint32_t, 3>& knots, double impulse);
  void edits(const scene::World& world, std::vector<scene::EditableParameter>& out) const override;
  void reset() override;
  void save(std::vector<std::uint8_t>& bytes) const override;
  bool restore(const std::uint8_t* bytes, std::size_t count) override;

  const bleeding::SurfaceState& state() const { return state_; }
  const bleeding::SurfaceModel& model() const { return model_; }

 private:
  template <class Archive, class S>
  static void walk(Archive& archive, S& state, double& scale) {
    archive(state.open), archive(state.drug), archive(state.styptic), archive(state.sealed),
        archive(state.film), archive(state.flow);
    archive(state.injected), archive(state.depot), archive(state.washed), archive(state.washed_moment);
    archive(state.used), archive(state.seeped), archive(state.shed), archive(state.active), archive(scale);
  }
  void follow(const scene::World& world, const std::vector<scene::Event>& events);
  void take(const scene::Event& event);
  void useTools(const scene::StepInput& input, const scene::StepReport& report);
  void tellFrame(const scene::World& world);

  SurfaceOptions options_;
  BloodEffect* blood_;
  bleeding::SurfaceModel model_;
  bleeding::SurfaceState state_;
  double scale_ = 1;
  std::vector<std::uint8_t> vessel_;           ///< per object: bleeds as a vessel, not here
  std::vector<std::vector<float>> positions_;  ///< per object, room for copies
  std::vector<const float*> rows_;
  bleeding::SurfaceInputs inputs_;
  scene::TripleBuffer<SurfaceFrame>* frames_;
  std::uint64_t frame_every_ = 100;
};

}  // namespace vest::simulation
