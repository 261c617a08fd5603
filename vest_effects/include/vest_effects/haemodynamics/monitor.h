#pragma once

#include "vest_effects/haemodynamics/circulation.h"

namespace vest::haemodynamics {

/// What a patient monitor shows beside pressures, at one moment.
struct MonitorCurves {
  double ecg = 0;    ///< V, lead II
  double pleth = 0;  ///< no unit: area of the reference artery over that of rest, minus 1
  double spo2 = 0;   ///< no unit, 0 … 1; NaN: the oximeter finds no pulse
};

/// s, from the start of the QRS complex to ejection, by the heart rate (Hz): 131 ms − 0.4 ms per beat a
/// minute (men; Weissler, Harris and Schoenfeld 1968, Circulation 37, 149).
constexpr double preEjection(double rate) {
  return 0.131 - 0.0004 * 60.0 * rate;
}
constexpr double kQrsToPeak =
    0.04;  ///< s, from the start of the complex to R: half of a QRS of 80 ms (assumed)
constexpr double kLeadPeak = 1e-3;  ///< V: R in lead II (assumed)
/// Saturation of a ventilated patient: ventilation is not simulated (assumed).
constexpr double kSaturation = 0.98;
/// Share of the pulse pressure at rest below which an oximeter finds no pulse (assumed).
constexpr double kLeastPulse = 0.1;

/// The curves now. A pure function of the state: it needs no memory of its own. Allocates nothing.
///
/// ECG: the sum of five Gaussians of the beat's angle, with the angles, heights and widths of P, Q, R, S and
/// T and their change with the heart rate of ECGSYN (McSharry, Clifford, Tarassenko and Smith 2003, IEEE
/// Trans. Biomed. Eng. 50, 289), integrated along the limit cycle without the slow return to the base line. R
/// is set to kLeadPeak. A heart that has stopped gives a flat line.
MonitorCurves monitorCurves(const CirculationModel& model, const CirculationState& state);

}  // namespace vest::haemodynamics
