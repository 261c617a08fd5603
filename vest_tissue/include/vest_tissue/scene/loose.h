#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "vest_tissue/scene/world.h"

namespace vest::scene {

/// Parts that nothing holds but instruments, as shares of an object's mass, 0 … 1.
struct LooseShare {
  double all = 0;
  double removed = 0;  ///< what of it is beyond the cavity's wall: it left through a trocar
};

/// Room to look for loose parts in a World and any of its States.
struct LooseScratch {
  explicit LooseScratch(const World& world);
  std::vector<std::uint32_t> part, first;
};

/// How much of an object nothing holds any more but instruments. Allocates nothing.
LooseShare looseShare(const World& world, std::size_t object, LooseScratch& scratch);

}  // namespace vest::scene
