#pragma once

namespace vest::material {

/// Fourth-order law of soft tissue (Maaß):
///   sigma(eps) = E·eps·(1 + a2·eps + a3·eps² + a4·eps³)   for eps >= 0
///   sigma(eps) = E·eps                                    for -0.15 <= eps < 0, continued monotonically
///   below
struct Law {
  double youngs_modulus = 0.0;  ///< Pa, E > 0
  double a2 = 0.0;              ///< no unit
  double a3 = 0.0;              ///< no unit
  double a4 = 0.0;              ///< no unit
  double max_strain =
      0.5;  ///< no unit; above it the law goes on along its tangent, so that it stays bounded and monotone
};

/// Strain below which the law is as printed in compression; further down it goes on with the same slope E.
inline constexpr double kCompressiveRange = -0.15;

/// sigma(eps), Pa: the law above with its continuations; monotone wherever isMonotone() holds.
double stress(const Law& law, double strain);
/// d sigma / d eps, Pa: what the step bound follows. Constant below 0 and above max_strain.
double tangent(const Law& law, double strain);
/// Integral of sigma from 0 to eps, J/m³: the energy of a link of area A and rest length L is A·L times this.
double energyDensity(const Law& law, double strain);
/// Whether the slope is positive in 0 … max_strain, so that the continued law is monotone and its tangent
/// bounded.
bool isMonotone(const Law& law);

}  // namespace vest::material
