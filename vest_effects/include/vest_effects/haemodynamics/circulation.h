#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "vest_effects/haemodynamics/drugs.h"
#include "vest_effects/haemodynamics/step.h"
#include "vest_effects/haemodynamics/vessels.h"

namespace vest::haemodynamics {

/// The circulation of one patient, live: arteries as pulse waves (step.h), veins as resistances, and the loop
/// that closes over them. A vessel is an artery (0 … arteries − 1, as Model::segments) or a vein (behind
/// them).
///
/// Loop (Guyton's venous return; Hall, Guyton and Hall Textbook of Medical Physiology, 13th ed., chapter 20):
///
///     P_fill = (V − V_u)/C
///     output = (P_fill − V_d/C − P_atrium)/R_v
///
/// V: blood volume, V_u: the part that fills without stretching, C: compliance. R_v follows from the state at
/// rest. The output drives the inflow curve.
///
/// The pneumoperitoneum, p Pa above the air, acts on the loop in two ways. The vena cava is a Starling
/// resistor where it leaves the abdomen (Takata et al. 1990, J. Appl. Physiol. 69, 1961): the legs drain only
/// against the gas. Their veins take on 8/14 of it (Beebe et al. 1993) and dam up V_d = C_legs p 8/14, which
/// is missing at the heart; who has lost blood misses it more. The resistance of all terminals rises by the
/// factor 1 + g p/(p + p_h): pressed vessels and vasopressin; in life those of the abdomen most (Robotham et
/// al. 1985, Crit. Care Med. 13, 803). It acts at once; in life a part of it takes minutes.
///
/// Baroreflex: tone follows the fall of the mean arterial pressure P below its goal,
///     goal tone = e/sqrt(1 + e²) + b, e = (P_goal − P)/width, b = (P_i − P)/5670 Pa in 0 … 1
/// (b: the brain's ischaemic response below P_i; Guyton, chapter 18), through three first-order lags (times
/// of Ursino 1998, Am. J. Physiol. 275 H1733) that act on heart rate, terminals' resistance and V_u (veins
/// give blood back). The rate's goal has e|e| for e: the heart answers small losses little (375 ml: 75 to 78
/// beats, pulse pressure −11 %, Leonetti et al. 2004, Clin. Auton. Res. 14, 176; 1000 ml: 60 to 68, Johnson
/// et al. 2015, FASEB J. 29, 823.4) and great ones as ATLS has it; the form is fitted to both. Loss lowers V
/// and takes red cells along. Transfusion raises both.
///
/// Crystalloid raises V by x, of which tissue takes what is more than its share at rest (volume kinetics: the
/// form of Hahn 2010, Anesthesiology 113, 470, without urine):
///
///     dx/dt = infusion − (x − f (x + y))/T,  dy/dt = (x − f (x + y))/T,  f = kStays, T = kShiftTime
///
/// Drugs (drugs.h) add to resistance, heart rate and what veins give back.
///
/// Not in it: how tilting moves blood, veins of the abdomen that are so full that gas presses blood out of
/// them, fluid that tissue gives back to the blood, urine, viscosity, and what happens after minutes of
/// shock.
struct CirculationModel {
  Vessels vessels;
  Model arteries;
  int reference = 0;                   ///< segment where the monitor measures
  double curve_output = 0;             ///< m³/s, mean of the inflow curve
  double curve_rate = 0;               ///< Hz, of the inflow curve
  double return_resistance = 0;        ///< R_v, Pa·s/m³
  double unstressed_volume = 0;        ///< V_u at rest, m³
  std::vector<double> territory_flow;  ///< m³/s at rest, per Vessels::territories
  double resting_pressure = 0;         ///< Pa, mean at the reference artery at rest: the reflex' goal
  double resting_pulse = 0;            ///< Pa, systolic minus diastolic there
  double ejection_phase = 0;           ///< s in the inflow curve at which the heart begins to eject
  int vesselCount() const { return static_cast<int>(arteries.segments.size() + vessels.veins.size()); }
  bool isVein(int vessel) const { return vessel >= static_cast<int>(arteries.segments.size()); }
  const std::string& name(int vessel) const;
  double length(int vessel) const;                 ///< m
  double lumen(int vessel, double station) const;  ///< m², cross-section at rest
  int find(const std::string& name) const;         ///< −1: none
};

/// What can be set while it runs; plain data.
struct CirculationSettings {
  double heart_rate = 0;  ///< Hz at rest; 0: the database's
  double mean_pressure =
      0;  ///< Pa, the reflex' goal and, by the resistance, what follows; 0: the resting one
  double resistance_scale = 1;               ///< factor on all terminals, > 0
  double reflex_scale = 1;                   ///< 0: no reflex … 1: the database's
  double infusion = 0;                       ///< m³/s of crystalloid, 0 … 1e-5 (600 ml/min)
  double transfusion = 0;                    ///< m³/s of red cells as units have them, 0 … 1e-5
  std::array<double, kDrugCount> infused{};  ///< kg/s of the drugs that are infused; 0 of the others
};

/// Volume of red cells over that of blood: the mean of women (OpenStax, Anatomy and Physiology, overview of
/// the blood: 0.37 … 0.47, mean 0.41); of units of red cells (Australian Red Cross Lifeblood, 2022: 0.60 ±
/// 0.03, allowed 0.50 … 0.70).
constexpr double kHaematocrit = 0.41, kUnitHaematocrit = 0.60;
/// Of crystalloid, no unit and s: fitted to Hahn 2020 (Acta Anaesthesiol. Scand. 64, 570): 50 … 60 % are in
/// the vessels while it runs, here for half an hour, and 15 … 20 % half an hour later.
constexpr double kStays = 0.15, kShiftTime = 900;

/// An opening of a vessel. For arteries as Hole; for veins the two resistances feed it.
struct VesselHole {
  int vessel = 0;
  double station = 0;  ///< m
  double area = 0;     ///< m²
};
/// A narrowing of a vessel, as Closure. Veins: shut below kVeinShut, else open.
struct VesselClosure {
  int vessel = 0;
  double station = 0;  ///< m
  double opening = 0;  ///< 0 shut … 1 open
};
constexpr double kVeinShut = 0.05;  ///< assumed
/// Pa, s: below 25 mmHg for a minute the heart, which feeds itself, stops (assumed).
constexpr double kArrestPressure = 3330, kArrestTime = 60;

struct CirculationInputs {
  CirculationSettings settings;
  double external_pressure = 0;  ///< Pa at the holes, above the air that pressures are counted from
  int hole_count = 0;
  std::array<VesselHole, kMostHoles> holes{};
  int closure_count = 0;
  std::array<VesselClosure, kMostClosures> closures{};
};

/// Everything that evolves. A copy is a snapshot.
struct CirculationState {
  State arteries;
  double lost = 0;                   ///< m³ in all
  double given = 0, transfused = 0;  ///< m³ by infusion and transfusion together, and of it by transfusion
  double crystalloid = 0;            ///< m³ of it that raise the volume in the vessels now
  double shifted = 0;                ///< m³ of it in tissue
  double cells = 0;                  ///< m³ of red cells in the vessels
  double lost_with_cells = 0;        ///< m³: `lost`, when the cells were counted last
  std::array<double, kDrugCount> drug_comes{}, drug_acts{};  ///< kg on its way, and at its place of effect
  double low_time = 0;                 ///< s that the mean pressure was below kArrestPressure
  bool arrested = false;               ///< the heart has stopped; nothing here starts it again
  std::vector<double> vessel_lost;     ///< m³ per vessel
  std::vector<double> territory_flow;  ///< m³/s into each territory, smoothed over kPerfusionTime
  double smoothed_pressure = 0;        ///< Pa, what the baroreceptors tell
  double rate_tone = 0, resistance_tone = 0, volume_tone = 0;  ///< no unit, −1 … 2
  double heart_rate = 0;                                       ///< Hz, now
  double output = 0;                                           ///< m³/s, cardiac output now
  double filling_pressure = 0;                                 ///< Pa
  double external_pressure = 0;                                ///< Pa around the veins, of the last step
  // of the last whole beat at the reference artery, Pa; and of the one that runs
  double systolic = 0, diastolic = 0, mean = 0;
  double beat_most = 0, beat_least = 0, beat_sum = 0, beat_time = 0;
  std::array<double, kMostHoles> hole_flow{};  ///< m³/s, mean of the last step, ≥ 0
  std::uint32_t degraded = 0;  ///< steps that ran with smaller holes, or not at all, because the model ended
};

/// Sized once.
struct CirculationScratch {
  explicit CirculationScratch(const CirculationModel& model, int threads = 1);
  Scratch arteries;
  Inputs inputs;
  std::array<int, kMostHoles> hole_of;  ///< artery hole -> hole of the inputs
};

/// Volume in the vessels, m³, and the share of it that is red cells.
double bloodVolume(const CirculationModel& model, const CirculationState& state);
double haematocrit(const CirculationModel& model, const CirculationState& state);
DrugEffect drugEffect(const CirculationState& state);
/// What the drugs add to the resistance of the vessels, over that without them.
double drugResistance(const CirculationModel& model, const CirculationSettings& settings,
                      const CirculationState& state);
/// Advances what is given and lost alone, by dt: volume, red cells, drugs (part of step()).
void stepContents(const CirculationModel& model, const CirculationSettings& settings, double dt,
                  CirculationState& state);
/// Gives a bolus (kg), or sets an infusion (kg/s), as the drug is given; 0 … Drug::most. False, and nothing
/// changes, out of that.
bool give(DrugIndex drug, double amount, CirculationSettings& settings, CirculationState& state);

/// Builds the model and the state at rest: runs the arteries until they are periodic, which takes about half
/// a second of wall time for 40 segments. `dx` in m. Throws NetworkError.
struct Circulation {
  CirculationModel model;
  CirculationState rest;
};
Circulation buildCirculation(Vessels vessels, double dx);

/// Advances by dt (s, ≤ 0.01). Allocates nothing with one thread, throws nothing; the same bits for any
/// number of threads. An input out of range is refused as kBadInput and changes nothing. No hole of an artery
/// is wider than its lumen. Where the arteries' model ends (flow as fast as waves through a great hole) the
/// step is tried again with smaller holes, at last with the blood at rest, and counted in `degraded`.
Status step(const CirculationModel& model, const CirculationInputs& inputs, double dt,
            CirculationState& state, CirculationScratch& scratch);

/// Brings a state at rest to where it stays under the inputs' settings and gas: the tones that uphold their
/// own mean pressure, found by bisection, and arteries that beat with it. Nothing changes where there is no
/// gas. Takes the wall time of 16 s of step().
void settle(const CirculationModel& model, const CirculationInputs& inputs, CirculationState& state,
            CirculationScratch& scratch);

/// Pressure (Pa), flow (m³/s, from the heart in arteries, to it in veins) and area (m²) at a station now. Of
/// veins without holes.
Sample at(const CirculationModel& model, const CirculationState& state, int vessel, double station);

/// s: in which tissue blanches and fills again: assumed. Adult women's capillary refill takes 1.2 s (median;
/// 2.9 s at most: Schriger and Baraff 1988, Ann. Emerg. Med. 17, 932), a beat one.
constexpr double kPerfusionTime = 2.0;
/// Flow into a territory over that at rest, no unit, 0 … 3.
double perfusion(const CirculationModel& model, const CirculationState& state, std::size_t territory);

/// Radius over the radius at the mean pressure of rest: what the pulse and the pressure do to an artery at a
/// share 0 … 1 of its length, no unit; 1 for veins. Float: as the wire carries it.
float dilatation(const CirculationModel& model, const CirculationState& state, int vessel, double along);

}  // namespace vest::haemodynamics
