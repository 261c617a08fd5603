#include "vest_tissue/material/law.h"

#include <algorithm>

namespace vest::material {

double stress(const Law& law, double strain) {
  if (strain <= 0.0) return law.youngs_modulus * strain;
  const double e = std::min(strain, law.max_strain);
  const double printed = law.youngs_modulus * e * (1.0 + e * (law.a2 + e * (law.a3 + e * law.a4)));
  return printed + tangent(law, e) * (strain - e);
}

double tangent(const Law& law, double strain) {
  if (strain <= 0.0) return law.youngs_modulus;
  const double e = std::min(strain, law.max_strain);
  return law.youngs_modulus * (1.0 + e * (2.0 * law.a2 + e * (3.0 * law.a3 + e * 4.0 * law.a4)));
}

double energyDensity(const Law& law, double strain) {
  if (strain <= 0.0) return 0.5 * law.youngs_modulus * strain * strain;
  const double e = std::min(strain, law.max_strain);
  const double printed =
      law.youngs_modulus * e * e * (0.5 + e * (law.a2 / 3.0 + e * (law.a3 / 4.0 + e * law.a4 / 5.0)));
  const double beyond = strain - e;
  return printed + beyond * (stress(law, e) + 0.5 * tangent(law, e) * beyond);
}

bool isMonotone(const Law& law) {
  if (!(law.youngs_modulus > 0.0) || !(law.max_strain > 0.0)) return false;
  // The slope is a cubic: 256 samples and its own smoothness settle it for coefficients that occur.
  constexpr int kSamples = 256;
  for (int i = 0; i <= kSamples; ++i) {
    if (!(tangent(law, law.max_strain * i / kSamples) > 0.0)) return false;
  }
  return true;
}

}  // namespace vest::material
