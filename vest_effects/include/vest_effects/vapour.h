#pragma once

#include <algorithm>

#include "vest_effects/arithmetic.h"

/// Water vapour over water: Magnus' formula with the coefficients of Alduchov and Eskridge 1996
/// (doi:10.1175/1520-0450(1996)035<0601:IMFAOS>2.0.CO;2). The same bits on every processor.
namespace vest::effects {

/// Pa at a temperature (K), clamped to −40 … 100 °C.
inline double saturationPressure(double kelvin) {
  const double t = std::clamp(kelvin - 273.15, -40.0, 100.0);
  return 610.94 * exponential(17.625 * t / (t + 243.04));
}

/// K at which gas of that temperature (K) and relative humidity (0 … 1) begins to condense.
inline double dewPoint(double kelvin, double humidity) {
  const double t = std::clamp(kelvin - 273.15, -40.0, 100.0);
  const double g = logarithm(std::clamp(humidity, 1e-6, 1.0)) + 17.625 * t / (t + 243.04);
  return 273.15 + 243.04 * g / (17.625 - g);
}

}  // namespace vest::effects
