#pragma once

#include <array>
#include <vector>

#include "vest_tissue/interaction/clip.h"
#include "vest_tissue/interaction/sling.h"

namespace vest::interaction {

/// State of all that closes vessels from outside. Capacities are reserved; beyond them a step is Degraded and
/// nothing more is set.
struct Fasteners {
  std::vector<Clip> clips;
  std::vector<Sling> slings;
  std::array<Applier, 4> appliers;  ///< per tools::Instrument

  void reserve() { clips.reserve(kMaxClips), slings.reserve(kMaxSlings); }
};

}  // namespace vest::interaction
