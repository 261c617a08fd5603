/// An image that can be felt, with its memory. volume/feel.h makes it.
#pragma once

#include <string>
#include <vector>

#include "vest_tissue/voxel/law.h"

namespace vest::voxel {

/// Owns what a View shows.
struct Volume {
  Header header;
  std::vector<std::int16_t> stored;
  std::vector<std::uint8_t> region;
  double spacing = 0, smoothing = 0;  ///< m, as they became
  double steepest = 0;  ///< share of full force that the yield changes by in 1 ms at 20 mm/s, at most
  std::vector<std::string> notes;  ///< for people: what was made coarser or smoother
  View view() const { return {&header, stored.data(), region.data()}; }
};

}  // namespace vest::voxel
