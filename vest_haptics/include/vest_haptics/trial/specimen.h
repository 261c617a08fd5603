/// Specimens with a known stress for a known strain, so that what a hand feels can be judged by the
/// material's law.
#pragma once

#include <string>
#include <vector>

#include "vest_tissue/material/database.h"
#include "vest_tissue/scene/description.h"

namespace vest::haptics {

/// A slab on a rigid ground, 60 × 60 × 16 mm, its upper face at z = 0.055 m under the origin: pressed with
/// the tip. The same net for each tissue, so that forces differ by the law alone. No gravity.
scene::Description pressedSlab(const material::Tissue& tissue);

/// A strip that stands on its fixed end, kStripArea × kStripLength, upper end at z = 0.055 m: jaws close
/// about its end and pull. Load is carried along the strip alone: force = area · σ(elongation / length). No
/// gravity.
scene::Description pulledStrip(const material::Tissue& tissue);
inline constexpr double kStripArea = 16e-6;    ///< m², 4 × 4 mm
inline constexpr double kStripLength = 0.030;  ///< m

/// What a hand felt at rest, and what the material's law says of it.
struct Felt {
  double depth = 0.0;   ///< m that the tissue gave way: > 0 pressed in, < 0 pulled out
  double strain = 0.0;  ///< no unit, of the specimen: < 0 pressed together
  double shown = 0.0;   ///< N at the device, along the shaft; > 0 pushes the hand back
  double law = 0.0;     ///< N
};

/// N per Pa·m: force of the pressed slab over E·depth. It holds the geometry of tip and net alone, so it is
/// one for all tissues (found on these very trials: mean of the three); in compression the law is the
/// straight line σ = E·ε.
inline constexpr double kPressShape = 4.86e-3;

/// Felt force and law differ by at most this share of the greatest: in use by the page and by the test.
inline constexpr double kFeltBound = 0.1;

/// A simulated Cartesian device presses to about a tenth of the slab's height, and rests at each half
/// millimetre.
std::vector<Felt> press(const material::Tissue& tissue);
/// It takes the strip's end between the jaws and pulls it out; law: area · σ(strain of the free part).
std::vector<Felt> pull(const material::Tissue& tissue);

}  // namespace vest::haptics
