#pragma once

namespace vest::material {

/// Fourth-order law of models.md section 3 (Maaß):
///   sigma(eps) = E·eps·(1 + a2·eps + a3·eps² + a4·eps³)   for eps >= 0
///   sigma(eps) = E·eps                                    for -0.15 <= eps < 0, continued monotonically below
struct Law {
  double youngs_modulus = 0.0;  ///< Pa, E > 0
  double a2 = 0.0;              ///< no unit
  double a3 = 0.0;              ///< no unit
  double a4 = 0.0;              ///< no unit
  double max_strain = 0.5;      ///< no unit; above it the law goes on along its tangent, so that it stays bounded and monotone
};

}  // namespace vest::material
