/// Specimens with a known stress for a known strain, so that what a hand feels can be judged by the
/// material's law.
#pragma once

#include <string>

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

}  // namespace vest::haptics
