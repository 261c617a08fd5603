#include "vest_effects/haemodynamics/circulation.h"

#include <algorithm>
#include <cmath>

namespace vest::haemodynamics {

namespace {

constexpr double kPi = 3.14159265358979323846;
// Pa: as far below its beginning the brain's ischaemic response is whole (60 to 17.5 mmHg: Hall, Guyton and
// Hall Textbook of Medical Physiology, 13th ed., chapter 18).
constexpr double kIschaemicRange = 5670;
// Of the pressure around them that veins of the abdomen take on: from 10.2 to 18.2 mmHg in the femoral vein
// under 14 mmHg (Beebe et al. 1993, Surg. Gynecol. Obstet. 176, 443-447 [not checked in print]).
constexpr double kVeinShare = 8.0 / 14.0;
// Pa (assumed): from here on the reflex no longer slows the heart. Under 12 to 15 mmHg its rate stays (Joris
// et al. 1993, Anesth. Analg. 76, 1067 [not checked in print]; hypercapnia and vasopressin act against the
// reflex).
constexpr double kNoSlowing = 1000;
constexpr int kHalvings = 6;  // of holes that the arteries' model does not bear
// Steps, and their s, in which arteries, then the loop follow settle(): some eight beats each.
constexpr int kSettling = 8000;
constexpr double kSettlingStep = 1e-3;

int cellAt(const SegmentModel& s, double station) {
  return std::clamp(static_cast<int>(station / s.dx), 0, s.cells - 1);
}

double cellPressure(const Model& m, const State& state, const SegmentModel& s, int cell) {
  const int i = s.first_cell + cell;
  return s.reference_pressure + m.beta[i] * (std::sqrt(state.area[i]) - m.sqrt_area_ref[i]);
}

double referencePressure(const CirculationModel& model, const CirculationState& state) {
  const SegmentModel& s = model.arteries.segments[model.reference];
  return cellPressure(model.arteries, state.arteries, s, s.cells / 2);
}

bool good(const CirculationModel& model, const CirculationInputs& in, double dt) {
  const CirculationSettings& set = in.settings;
  bool ok = dt >= 0 && dt <= 0.01 && set.heart_rate >= 0 && set.heart_rate <= 5 && set.mean_pressure >= 0 &&
            set.mean_pressure <= 5e4 && set.resistance_scale >= 0.05 && set.resistance_scale <= 20 &&
            set.reflex_scale >= 0 && set.reflex_scale <= 1 && set.infusion >= 0 && set.infusion <= 1e-5 &&
            set.transfusion >= 0 && set.transfusion <= 1e-5 && std::isfinite(in.external_pressure) &&
            in.hole_count >= 0 && in.hole_count <= kMostHoles && in.closure_count >= 0 &&
            in.closure_count <= kMostClosures;
  for (std::size_t d = 0; ok && d < kDrugCount; ++d)
    ok = set.infused[d] >= 0 && set.infused[d] <= (kDrugs[d].infused ? kDrugs[d].most : 0);
  const auto inside = [&](int vessel, double station) {
    return vessel >= 0 && vessel < model.vesselCount() && station >= 0 && station <= model.length(vessel);
  };
  for (int i = 0; ok && i < in.hole_count; ++i)
    ok = inside(in.holes[i].vessel, in.holes[i].station) && in.holes[i].area >= 0 &&
         std::isfinite(in.holes[i].area);
  for (int i = 0; ok && i < in.closure_count; ++i)
    ok = inside(in.closures[i].vessel, in.closures[i].station) && in.closures[i].opening >= 0 &&
         in.closures[i].opening <= 1;
  return ok;
}

/// Of the resistance at rest.
double reflexResistance(const CirculationModel& model, const CirculationSettings& set,
                        const CirculationState& s) {
  return 1 + model.vessels.control.resistance_gain * set.reflex_scale * s.resistance_tone;
}

/// Factor on all terminals.
double terminalResistance(const CirculationModel& model, const CirculationSettings& set,
                          const CirculationState& s) {
  const ControlNumbers& c = model.vessels.control;
  const double goal = set.mean_pressure > 0 ? set.mean_pressure / model.resting_pressure : 1;
  const double gas = std::max(0.0, s.external_pressure);
  return set.resistance_scale * goal * reflexResistance(model, set, s) * (1 + drugResistance(model, set, s)) *
         (1 + c.gas_resistance_gain * gas / (gas + c.gas_resistance_pressure));
}

/// Share of a drug's effect that is left beside the reflex' tone.
double leftBeside(double tone) {
  return 1 - tone / kMostTone;
}

void setInputs(const CirculationModel& model, const CirculationInputs& in, const CirculationState& state,
               double hole_scale, CirculationScratch& scratch) {
  const CirculationSettings& set = in.settings;
  Inputs& a = scratch.inputs;
  a.heart_rate_scale = state.heart_rate / model.curve_rate;
  a.flow_scale = state.output / model.curve_output;
  a.resistance_scale = terminalResistance(model, set, state);
  a.hole_count = a.closure_count = 0;
  for (int i = 0; i < in.hole_count; ++i) {
    const VesselHole& h = in.holes[i];
    if (model.isVein(h.vessel)) continue;
    scratch.hole_of[a.hole_count] = i;
    a.holes[a.hole_count++] = {h.vessel,
                               h.station,
                               std::min(h.area, model.lumen(h.vessel, h.station)) * hole_scale,
                               model.vessels.control.discharge,
                               in.external_pressure,
                               true};
  }
  for (int i = 0; i < in.closure_count; ++i) {
    const VesselClosure& c = in.closures[i];
    if (!model.isVein(c.vessel)) a.closures[a.closure_count++] = {c.vessel, c.station, c.opening};
  }
}

/// Flow out of the holes of one vein, m³/s each, into state.hole_flow. Holes between the same two closures
/// share what feeds them: k Q² + Q/G = p, k = rho/(2 (Cd A)²), p and G of the open sides.
void stepVein(const CirculationModel& model, const CirculationInputs& in, int vessel,
              CirculationState& state) {
  const Vein& vein = model.vessels.veins[vessel - static_cast<int>(model.arteries.segments.size())];
  const double fill = std::max(
      0.0, state.filling_pressure / model.vessels.control.filling_pressure);  // loss empties veins too
  const double around = kVeinShare * std::max(0.0, in.external_pressure);
  for (int side = 1; side <= 3; ++side) {  // 1: fed from the heart's side, 2: from the venules, 3: from both
    double area = 0;
    const auto fedFrom = [&](const VesselHole& h) {
      int open = 3;
      for (int i = 0; i < in.closure_count; ++i) {
        const VesselClosure& c = in.closures[i];
        if (c.vessel != vessel || c.opening >= kVeinShut) continue;
        if (c.station <= h.station) open &= 2;
        if (c.station >= h.station) open &= 1;
      }
      return open;
    };
    for (int i = 0; i < in.hole_count; ++i)
      if (in.holes[i].vessel == vessel && fedFrom(in.holes[i]) == side) area += in.holes[i].area;
    if (!(area > 0)) continue;
    double conductance = 0, drive = 0;
    if (side & 1) {
      conductance += 1 / vein.centralResistance();
      drive += vein.central_pressure * fill / vein.centralResistance();
    }
    if (side & 2) {
      conductance += 1 / vein.upstreamResistance();
      drive += vein.upstream_pressure * fill / vein.upstreamResistance();
    }
    const double p = drive / conductance + around - in.external_pressure;
    if (!(p > 0)) continue;
    const double orifice = model.vessels.control.discharge * area;
    const double k = 0.5 * model.arteries.density / (orifice * orifice), r = 1 / conductance;
    const double flow = 2 * p / (r + std::sqrt(r * r + 4 * k * p));
    for (int i = 0; i < in.hole_count; ++i)
      if (in.holes[i].vessel == vessel && fedFrom(in.holes[i]) == side)
        state.hole_flow[i] = flow * in.holes[i].area / area;
  }
}

struct Tones {
  double rate = 0, resistance = 0, volume = 0;
};

/// Where the smoothed pressure drives the three tones to.
Tones toneGoals(const CirculationModel& model, const CirculationSettings& set, const CirculationState& s) {
  const ControlNumbers& c = model.vessels.control;
  const double fall =
      (set.mean_pressure > 0 ? set.mean_pressure : model.resting_pressure) - s.smoothed_pressure;
  const double brain =
      set.reflex_scale > 0 && c.ischaemic_pressure > 0
          ? std::clamp((c.ischaemic_pressure - s.smoothed_pressure) / kIschaemicRange, 0.0, 1.0)
          : 0.0;
  const auto toneOf = [&](double width) {
    const double e = fall / width;
    return e / std::sqrt(1 + e * e) + brain;
  };
  // The heart leaves small losses to the vessels: e|e| for e.
  const double e = fall / c.reflex_width, rate = e * std::fabs(e) / std::sqrt(1 + e * e * e * e);
  // The pressure that the gas adds does not slow the heart.
  const double slows = 1 - std::clamp(s.external_pressure / kNoSlowing, 0.0, 1.0);
  return {(rate < 0 ? slows * rate : rate) + brain, toneOf(c.resistance_width), toneOf(c.reflex_width)};
}

/// Filling pressure, output and heart rate that follow from volume, tones, drugs and gas.
void findOutput(const CirculationModel& model, const CirculationSettings& set, CirculationState& s) {
  const ControlNumbers& c = model.vessels.control;
  const DrugEffect drugs = drugEffect(s);
  const double volume_tone =
      set.reflex_scale * s.volume_tone * (s.volume_tone < 0 ? c.reflex_relaxation : 1.0);
  const double unstressed =
      model.unstressed_volume - c.reflex_volume * volume_tone - drugs.volume * leftBeside(volume_tone);
  s.filling_pressure = std::max(0.0, (bloodVolume(model, s) - unstressed) / c.systemic_compliance);
  const double dammed = c.leg_compliance * kVeinShare * std::max(0.0, s.external_pressure);
  const double drive = s.filling_pressure - dammed / c.systemic_compliance - c.atrial_pressure;
  s.output = s.arrested ? 0.0 : std::max(0.0, drive / model.return_resistance);
  const double rest = set.heart_rate > 0 ? set.heart_rate : c.heart_rate;
  const double rate_tone = set.reflex_scale * s.rate_tone;
  s.heart_rate =
      std::clamp(rest * (1 + c.rate_gain * rate_tone + drugs.rate * leftBeside(rate_tone)), 0.3, 4.0);
}

/// What the baroreceptors tell.
void hear(const CirculationModel& model, double dt, CirculationState& s) {
  s.smoothed_pressure += (referencePressure(model, s) - s.smoothed_pressure) *
                         (dt / (model.vessels.control.baroreceptor_time + dt));
}

/// Tone, output and heart rate for the next step.
void stepLoop(const CirculationModel& model, const CirculationSettings& set, double dt, CirculationState& s) {
  const ControlNumbers& c = model.vessels.control;
  hear(model, dt, s);
  const Tones goal = toneGoals(model, set, s);
  s.rate_tone += (goal.rate - s.rate_tone) * (dt / (c.rate_time + dt));
  s.resistance_tone += (goal.resistance - s.resistance_tone) * (dt / (c.resistance_time + dt));
  s.volume_tone += (goal.volume - s.volume_tone) * (dt / (c.volume_time + dt));

  s.low_time = s.smoothed_pressure < kArrestPressure ? s.low_time + dt : 0;
  s.arrested = s.arrested || s.low_time > kArrestTime;
  findOutput(model, set, s);
}

/// m³/s that leaves the ends which feed a territory.
double inflow(const CirculationModel& model, const CirculationState& s, const Territory& territory) {
  double sum = 0;
  for (const int i : territory.segments) sum += at(model, s, i, model.arteries.segments[i].length).flow;
  return sum;
}

void stepBeat(const CirculationModel& model, double dt, double phase_before, CirculationState& s) {
  const double pressure = referencePressure(model, s);
  if (s.arteries.phase < phase_before && s.beat_time > 0) {
    s.systolic = s.beat_most;
    s.diastolic = s.beat_least;
    s.mean = s.beat_sum / s.beat_time;
    s.beat_most = s.beat_least = pressure;
    s.beat_sum = s.beat_time = 0;
  }
  s.beat_most = std::max(s.beat_most, pressure);
  s.beat_least = std::min(s.beat_least, pressure);
  s.beat_sum += pressure * dt;
  s.beat_time += dt;
}

}  // namespace

double bloodVolume(const CirculationModel& model, const CirculationState& s) {
  return model.vessels.control.blood_volume - s.lost + s.crystalloid + s.transfused;
}

double haematocrit(const CirculationModel& model, const CirculationState& s) {
  return s.cells / std::max(1e-9, bloodVolume(model, s));
}

DrugEffect drugEffect(const CirculationState& s) {
  double all = 1;
  DrugEffect sum;
  for (std::size_t d = 0; d < kDrugCount; ++d) {
    const double x = s.drug_acts[d] / kDrugs[d].half;
    all += x;
    sum.resistance += kDrugs[d].resistance * x;
    sum.rate += kDrugs[d].rate * x;
    sum.volume += kDrugs[d].volume * x;
  }
  sum.resistance /= all, sum.rate /= all, sum.volume /= all;
  return sum;
}

double drugResistance(const CirculationModel& model, const CirculationSettings& set,
                      const CirculationState& s) {
  return drugEffect(s).resistance * leftBeside(set.reflex_scale * s.resistance_tone) /
         reflexResistance(model, set, s);
}

void stepContents(const CirculationModel& model, const CirculationSettings& set, double dt,
                  CirculationState& s) {
  const double volume = bloodVolume(model, s), gone = s.lost - s.lost_with_cells;
  if (volume > 0) s.cells *= volume / (volume + std::max(0.0, gone));
  s.lost_with_cells = s.lost;
  s.cells += kUnitHaematocrit * set.transfusion * dt;
  s.transfused += set.transfusion * dt;
  s.given += (set.infusion + set.transfusion) * dt;
  const double shift = (s.crystalloid - kStays * (s.crystalloid + s.shifted)) * dt / (dt + kShiftTime);
  s.crystalloid += set.infusion * dt - shift;
  s.shifted += shift;
  for (std::size_t d = 0; d < kDrugCount; ++d) {
    const double arrives = s.drug_comes[d] * dt / (dt + kDrugs[d].lag);
    s.drug_comes[d] += set.infused[d] * dt - arrives;
    s.drug_acts[d] += arrives - s.drug_acts[d] * dt / (dt + kDrugs[d].time);
  }
}

bool give(DrugIndex drug, double amount, CirculationSettings& settings, CirculationState& state) {
  if (!(amount >= 0 && amount <= kDrugs[drug].most)) return false;
  if (kDrugs[drug].infused)
    settings.infused[drug] = amount;
  else
    state.drug_comes[drug] += amount;
  return true;
}

const std::string& CirculationModel::name(int vessel) const {
  const int n = static_cast<int>(arteries.segments.size());
  return vessel < n ? arteries.segments[vessel].name : vessels.veins[vessel - n].name;
}

double CirculationModel::length(int vessel) const {
  const int n = static_cast<int>(arteries.segments.size());
  return vessel < n ? arteries.segments[vessel].length : vessels.veins[vessel - n].length;
}

double CirculationModel::lumen(int vessel, double station) const {
  if (isVein(vessel)) {
    const double r = vessels.veins[vessel - static_cast<int>(arteries.segments.size())].radius;
    return kPi * r * r;
  }
  const SegmentModel& s = arteries.segments[vessel];
  const double root = arteries.sqrt_area_ref[s.first_cell + cellAt(s, station)];
  return root * root;
}

int CirculationModel::find(const std::string& wanted) const {
  for (int i = 0; i < vesselCount(); ++i)
    if (name(i) == wanted) return i;
  return -1;
}

CirculationScratch::CirculationScratch(const CirculationModel& model, int threads)
    : arteries(model.arteries, threads) {
  hole_of.fill(0);
}

Circulation buildCirculation(Vessels vessels, double dx) {
  Circulation out;
  CirculationModel& m = out.model;
  m.arteries = buildModel(vessels.network, dx);
  m.vessels = std::move(vessels);
  for (std::size_t i = 0; i < m.arteries.segments.size(); ++i)
    if (m.arteries.segments[i].name == m.vessels.reference_artery) m.reference = static_cast<int>(i);
  const ControlNumbers& c = m.vessels.control;
  m.curve_rate = 1 / m.arteries.period;
  m.curve_output = m.arteries.inflowVolume(m.arteries.period) / m.arteries.period;
  const auto& curve = m.arteries.inflow_flow;
  const double begun = 0.01 * *std::max_element(curve.begin(), curve.end());
  for (std::size_t i = 1; i < curve.size() && m.ejection_phase == 0; ++i)
    if (curve[i] > begun && curve[i - 1] <= begun) m.ejection_phase = m.arteries.inflow_time[i - 1];
  if (!(m.curve_output > 0))
    throw NetworkError(m.vessels.network.inflow_file, 0, "Q_m3_s", formatNumber(m.curve_output),
                       "a mean > 0");
  m.return_resistance = (c.filling_pressure - c.atrial_pressure) / m.curve_output;
  m.unstressed_volume = c.blood_volume - c.systemic_compliance * c.filling_pressure;

  // Rest: the curve at the resting rate, until one beat's mean pressure is the last one's.
  CirculationState& s = out.rest;
  s.arteries = initialState(m.arteries);
  Scratch scratch(m.arteries);
  Inputs inputs;
  inputs.heart_rate_scale = c.heart_rate / m.curve_rate;
  const double dt = 1e-3;
  double before = 0, sum = 0, most = 0, least = 1e9;
  int steps = 0;
  const auto& territories = m.vessels.territories;
  std::vector<double> fed(territories.size(), 0.0);
  for (int beat = 0; beat < 60;) {
    const double phase = s.arteries.phase;
    const StepReport report = step(m.arteries, inputs, dt, s.arteries, scratch);
    if (report.status != Status::kOk)
      throw NetworkError(m.vessels.network.network_file, 0, "network",
                         report.segment >= 0 ? m.arteries.segments[report.segment].name : "-",
                         std::string("one that can be run at rest (") + toText(report.status) + ")");
    const double p = referencePressure(m, s);
    sum += p, most = std::max(most, p), least = std::min(least, p);
    ++steps;
    for (std::size_t k = 0; k < fed.size(); ++k) fed[k] += inflow(m, s, territories[k]);
    if (s.arteries.phase >= phase) continue;
    for (double& flow : fed) flow /= steps;
    m.territory_flow = fed;
    std::fill(fed.begin(), fed.end(), 0.0);
    const double mean = sum / steps;
    s.systolic = most, s.diastolic = least, s.mean = mean;
    ++beat;
    if (beat > 3 && std::fabs(mean - before) < 1e-4 * std::fabs(mean)) break;
    before = mean, sum = 0, most = 0, least = 1e9, steps = 0;
  }
  m.resting_pressure = s.mean;
  m.resting_pulse = s.systolic - s.diastolic;
  s.smoothed_pressure = s.mean;
  s.beat_most = s.beat_least = referencePressure(m, s);
  s.cells = kHaematocrit * c.blood_volume;
  s.vessel_lost.assign(m.vesselCount(), 0);
  s.territory_flow = m.territory_flow;
  s.heart_rate = c.heart_rate;
  s.output = m.curve_output;
  s.filling_pressure = c.filling_pressure;
  std::fill(s.arteries.leak_volume.begin(), s.arteries.leak_volume.end(), 0.0);
  std::fill(s.arteries.node_volume.begin(), s.arteries.node_volume.end(), 0.0);
  s.arteries.time = 0;
  return out;
}

Status step(const CirculationModel& model, const CirculationInputs& inputs, double dt,
            CirculationState& state, CirculationScratch& scratch) {
  if (!good(model, inputs, dt)) return Status::kBadInput;
  stepContents(model, inputs.settings, dt, state);
  state.external_pressure = inputs.external_pressure;
  stepLoop(model, inputs.settings, dt, state);
  state.hole_flow.fill(0);
  const double phase = state.arteries.phase;
  Status status = Status::kOk;
  double scale = 1;
  for (int attempt = 0; attempt <= kHalvings; ++attempt, scale *= attempt == kHalvings ? 0 : 0.5) {
    setInputs(model, inputs, state, scale, scratch);
    status = step(model.arteries, scratch.inputs, dt, state.arteries, scratch.arteries).status;
    if (status == Status::kOk) break;
  }
  if (scale < 1 || status != Status::kOk) ++state.degraded;
  // Beyond help: the blood stands still for a moment, and the next step begins from there.
  if (status != Status::kOk) std::fill(state.arteries.velocity.begin(), state.arteries.velocity.end(), 0.0);
  if (status == Status::kOk) {
    for (int i = 0; i < scratch.inputs.hole_count; ++i)
      state.hole_flow[scratch.hole_of[i]] = std::max(0.0, state.arteries.hole_flow[i]);
  }
  for (int v = static_cast<int>(model.arteries.segments.size()); v < model.vesselCount(); ++v)
    stepVein(model, inputs, v, state);
  for (int i = 0; i < inputs.hole_count; ++i) {
    const double volume = state.hole_flow[i] * dt;
    state.vessel_lost[inputs.holes[i].vessel] += volume;
    state.lost += volume;
  }
  const auto& territories = model.vessels.territories;
  for (std::size_t k = 0; k < territories.size(); ++k)
    state.territory_flow[k] +=
        (inflow(model, state, territories[k]) - state.territory_flow[k]) * dt / (dt + kPerfusionTime);
  stepBeat(model, dt, phase, state);
  return status;
}

void settle(const CirculationModel& model, const CirculationInputs& inputs, CirculationState& state,
            CirculationScratch& scratch) {
  if (!(inputs.external_pressure > 0)) return;
  const CirculationSettings& set = inputs.settings;
  state.external_pressure = inputs.external_pressure;
  // The mean pressure that its own tones uphold: it goes as output times resistance.
  double low = 0, high = 3 * model.resting_pressure;
  for (int i = 0; i < 50; ++i) {
    state.smoothed_pressure = 0.5 * (low + high);
    const Tones t = toneGoals(model, set, state);
    state.rate_tone = t.rate, state.resistance_tone = t.resistance, state.volume_tone = t.volume;
    findOutput(model, set, state);
    const double upheld =
        model.resting_pressure * state.output / model.curve_output * terminalResistance(model, set, state);
    (upheld > state.smoothed_pressure ? low : high) = state.smoothed_pressure;
  }
  const double rise = state.smoothed_pressure / model.resting_pressure,
               flow = state.output / model.curve_output;
  for (const SegmentModel& segment : model.arteries.segments)
    for (int cell = 0; cell < segment.cells; ++cell) {
      const int i = segment.first_cell + cell;
      const double root =
          model.arteries.sqrt_area_ref[i] +
          (rise * cellPressure(model.arteries, state.arteries, segment, cell) - segment.reference_pressure) /
              model.arteries.beta[i];
      state.arteries.area[i] = root * root;
      state.arteries.velocity[i] *= flow;
    }
  for (double& pressure : state.arteries.windkessel_pressure) pressure *= rise;
  for (double& into : state.territory_flow) into *= flow;
  const double time = state.arteries.time;
  for (int i = 0; i < kSettling; ++i) {  // the beats become equal while the loop stands still
    const double phase = state.arteries.phase;
    setInputs(model, inputs, state, 1, scratch);
    step(model.arteries, scratch.inputs, kSettlingStep, state.arteries, scratch.arteries);
    hear(model, kSettlingStep, state);
    stepBeat(model, kSettlingStep, phase, state);
  }
  for (int i = 0; i < kSettling; ++i) step(model, inputs, kSettlingStep, state, scratch);
  state.arteries.time = time;
}

Sample at(const CirculationModel& model, const CirculationState& state, int vessel, double station) {
  Sample out;
  if (model.isVein(vessel)) {
    const Vein& v = model.vessels.veins[vessel - static_cast<int>(model.arteries.segments.size())];
    const double fill = state.filling_pressure / model.vessels.control.filling_pressure;
    out.pressure = v.pressure * fill + kVeinShare * std::max(0.0, state.external_pressure);
    out.flow = v.flow * fill;
    out.area = kPi * v.radius * v.radius;
    return out;
  }
  const SegmentModel& s = model.arteries.segments[vessel];
  const int cell = cellAt(s, station), i = s.first_cell + cell;
  out.pressure = cellPressure(model.arteries, state.arteries, s, cell);
  out.area = state.arteries.area[i];
  out.flow = out.area * state.arteries.velocity[i];
  return out;
}

double perfusion(const CirculationModel& model, const CirculationState& state, std::size_t territory) {
  return model.territory_flow[territory] > 0
             ? std::clamp(state.territory_flow[territory] / model.territory_flow[territory], 0.0, 3.0)
             : 1.0;
}

float dilatation(const CirculationModel& model, const CirculationState& state, int vessel, double along) {
  if (model.isVein(vessel)) return 1.0f;
  const Model& m = model.arteries;
  const SegmentModel& s = m.segments[vessel];
  const auto of = [&](int cell) {
    const int i = s.first_cell + cell;
    const double rest = m.sqrt_area_ref[i] + (model.resting_pressure - s.reference_pressure) / m.beta[i];
    return std::sqrt(state.arteries.area[i]) / rest;
  };
  const double place = std::clamp(along * s.cells - 0.5, 0.0, s.cells - 1.0);  // cells hold their means
  const int before = std::min(static_cast<int>(place), std::max(0, s.cells - 2));
  const double part = place - before;
  return static_cast<float>((1 - part) * of(before) + part * of(std::min(before + 1, s.cells - 1)));
}

}  // namespace vest::haemodynamics
