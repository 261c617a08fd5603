#include "vest_effects/haemodynamics/monitor.h"

#include <array>
#include <cmath>
#include <limits>

#include "vest_effects/arithmetic.h"

namespace vest::haemodynamics {
namespace {

constexpr double kPi = 3.14159265358979323846;

/// One wave of the ECG: angle from R at 60 beats a minute, slope that pulls, width (rad).
struct Wave {
  double angle, height, width;
  int power;  ///< of the rate's fourth root by which its angle grows
};
constexpr std::array<Wave, 5> kWaves{{{-70 * kPi / 180, 1.2, 0.25, 1},
                                      {-15 * kPi / 180, -5.0, 0.1, 2},
                                      {0, 30.0, 0.1, 0},
                                      {15 * kPi / 180, -7.5, 0.1, 2},
                                      {100 * kPi / 180, 0.75, 0.4, 1}}};

double electrocardiogram(const CirculationModel& model, const CirculationState& state) {
  const double rate = state.heart_rate;
  if (state.arrested || !(rate > 0)) return 0;
  // The inflow curve is run through faster than it was written.
  const double period = model.arteries.period,
               ahead = (preEjection(rate) - kQrsToPeak) * rate / model.curve_rate,
               beat = (state.arteries.phase - model.ejection_phase + ahead) / period;
  const double angle = 2 * kPi * (beat - std::floor(beat + 0.5));
  const double half = std::sqrt(rate), quarter = std::sqrt(half);  // of the rate over 60 a minute
  const std::array<double, 3> grow{1.0, quarter, half};
  double sum = 0, peak = 0;
  for (const Wave& w : kWaves) {
    const double width = w.width * half, weight = w.height * width * width,
                 centre = w.angle * grow[static_cast<std::size_t>(w.power)];
    const double turns = (angle - centre) / (2 * kPi),
                 away = 2 * kPi * (turns - std::floor(turns + 0.5)) / width;
    sum += weight * effects::exponential(-0.5 * away * away);
    const double from_peak = centre / width;
    peak += weight * effects::exponential(-0.5 * from_peak * from_peak);
  }
  return kLeadPeak * sum / peak;
}

}  // namespace

MonitorCurves monitorCurves(const CirculationModel& model, const CirculationState& state) {
  MonitorCurves out;
  out.ecg = electrocardiogram(model, state);
  const double middle = 0.5 * model.length(model.reference);
  out.pleth = at(model, state, model.reference, middle).area / model.lumen(model.reference, middle) - 1;
  const bool pulse = !state.arrested && state.systolic - state.diastolic > kLeastPulse * model.resting_pulse;
  out.spo2 = pulse ? kSaturation : std::numeric_limits<double>::quiet_NaN();
  return out;
}

}  // namespace vest::haemodynamics
