#pragma once

#include <memory>
#include <string>
#include <vector>

#include "vest_bringup/simulation/effect.h"
#include "vest_effects/bleeding/wounds.h"
#include "vest_effects/haemodynamics/monitor.h"
#include "vest_tissue/scene/ring.h"

namespace vest::simulation {

struct BloodOptions {
  std::string vessels;          ///< folder of the knowledge database (vest_effects/haemodynamics/vessels.h)
  double dx = 0.010;            ///< m, greatest cell of the arteries
  double pulse_dilatation = 1;  ///< no unit: 1 physiological; more for teaching, 0 … 20
  double frame_rate = 100;      ///< Hz of simulated time, 50 … 1000
  double gas_pressure = 0;      ///< Pa of the pneumoperitoneum that the patient has got used to at the start
};

/// What the patient monitor and viewers are told, now and then.
struct BloodFrame {
  struct Vessel {
    float pressure_prox = 0, pressure_mid = 0, pressure_dist = 0;  ///< Pa
    float flow_mid = 0;                                            ///< m³/s
    float radius_mid = 0;                                          ///< m
    float dilatation = 1;                                          ///< no unit, as the tissue gets it
    float leak = 0;                                                ///< m³/s
    double loss = 0;                                               ///< m³
    float closure = 0;                                             ///< 0 open … 1 closed
  };
  std::uint64_t step = 0;
  double heart_rate = 0;                         ///< Hz
  double systolic = 0, diastolic = 0, mean = 0;  ///< Pa
  double pressure = 0;                           ///< Pa, now, where the others are measured
  haemodynamics::MonitorCurves curves;
  double blood_volume = 0, blood_loss = 0;  ///< m³
  double given = 0, transfused = 0;         ///< m³ by infusion and transfusion, and of it by transfusion
  double haematocrit = 0;                   ///< red cells over blood
  double vasopressor = 0;                   ///< what drugs add to the resistance, over that without them
  bool arrested = false;
  double loss_rate = 0;                           ///< m³/s now, of vessels and surfaces
  std::uint32_t degraded_steps = 0, refused = 0;  ///< since the start
  std::shared_ptr<const std::vector<std::string>> names;
  std::vector<Vessel> vessels;  ///< arteries, then veins
};

/// Circulation, openings of vessels and the pulse in the scene. Jaws that hold a vessel and tools that press
/// on one close it while they do, and so does a kink or a pull that narrows it; gauze covers what bleeds
/// under it; a sucker takes clots off openings. An object of the scene belongs to a vessel by its
/// `vessel_segment`; its station 0 … length runs along the whole vessel.
///   events (cut, punctured, torn, perforated, clipped, unclipped, ligated, coagulated) -> wounds
///   circulation -> fluid sources at the wounds, and dilatation of the scene's vessels every fourth step
/// Parameter edits (object empty): heart_rate (Hz), mean_pressure (Pa), resistance_scale, reflex_scale,
/// infusion and transfusion (m³/s), pulse_dilatation, and the drugs of haemodynamics::kDrugs. With the name
/// of a vessel's object: opening_station (m), then opening_area (m²) opens it there; clip_station (m) closes
/// it there: complications that an instructor sets.
class BloodEffect : public Effect {
 public:
  /// @param frames may be null  @throws haemodynamics::NetworkError, std::invalid_argument
  BloodEffect(const scene::World& world, const BloodOptions& options,
              scene::TripleBuffer<BloodFrame>* frames);

  Ports ports() const override { return {kGas, kSeeped, kSources | kSupply | kClots}; }
  void step(const scene::World& world, const scene::StepInput& input, const scene::StepReport& report,
            Feedback& feedback) override;
  void edits(const scene::World& world, std::vector<scene::EditableParameter>& out) const override;
  void reset() override;
  /// The circulation goes on where both scenes have the same vessels. Openings, clips and seals of objects
  /// that are not kept go with them.
  void adopt(const Effect& before, const std::vector<std::uint32_t>& objects) override;
  void save(std::vector<std::uint8_t>& bytes) const override;
  bool restore(const std::uint8_t* bytes, std::size_t count) override;

  /// Blood that left otherwise (seeping surfaces), m³ in `dt` s.
  void lose(double volume, double dt) {
    state_.circulation.lost += volume > 0 ? volume : 0;
    seeping_ = dt > 0 ? volume / dt : 0;
  }

  /// How far the veins of a territory are open, 0 … 1: their mean; 1 where none is known.
  double drained(std::size_t territory) const;

  const haemodynamics::CirculationModel& model() const { return circulation_.model; }
  const haemodynamics::CirculationState& circulation() const { return state_.circulation; }
  const haemodynamics::CirculationSettings& settings() const { return state_.settings; }
  /// Where vessels are bent or drawn out so far that they are narrow.
  const bleeding::Pinches& kinks() const { return state_.kinks; }
  const bleeding::WoundState& wounds() const { return state_.wounds; }

 private:
  struct State {
    haemodynamics::CirculationState circulation;
    haemodynamics::CirculationSettings settings;
    bleeding::WoundState wounds;
    bleeding::Pinches kinks;  ///< as found last
    double pulse_dilatation = 1;
    double opening_station = 0;  ///< m, of an instructor's opening to come
  };
  template <class Archive, class S>
  static void walk(Archive& archive, S& state);

  bleeding::Place placeOf(const scene::World& world, std::size_t object, double station) const;
  void findKinks(const scene::World& world);
  void findPinches(const scene::World& world, const scene::StepReport& report);
  void cover(const scene::World& world, const scene::StepInput& input, const scene::StepReport& report);
  void suckClots(const scene::World& world, const scene::StepInput& input, const scene::StepReport& report,
                 Feedback& feedback);
  void take(const scene::World& world, const scene::ParameterEdit& edit);
  void take(const scene::World& world, const scene::Event& event);
  void openAt(const scene::World& world, std::size_t object, double station, double area,
              const Eigen::Vector3d* place);
  void tellSources(const scene::World& world, Feedback& feedback) const;
  void tellFrame(std::uint64_t step);

  BloodOptions options_;
  haemodynamics::Circulation circulation_;
  haemodynamics::CirculationScratch scratch_;
  haemodynamics::CirculationInputs inputs_;
  State state_;
  bleeding::Pinches pinches_;
  double seeping_ = 0;                          ///< m³/s, to be told
  std::vector<int> vessel_of_;                  ///< per object of the scene; −1: none
  std::vector<std::vector<double>> rest_area_;  ///< m², per object that is a vessel, per ring, as loaded
  std::vector<Eigen::Vector3d> centres_;        ///< m, of one vessel's rings; no meaning between steps
  std::vector<double> areas_;                   ///< m², likewise
  std::vector<std::uint8_t> shown_;             ///< per vessel: the scene has it
  std::vector<scene::VesselName> names_;
  std::shared_ptr<const std::vector<std::string>> frame_names_;
  scene::TripleBuffer<BloodFrame>* frames_;
  std::uint64_t frame_every_ = 10;
};

}  // namespace vest::simulation
