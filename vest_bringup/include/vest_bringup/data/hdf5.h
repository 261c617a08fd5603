#pragma once

#include <string>
#include <vector>

#include "vest_bringup/data/table.h"

namespace vest::data {

/// Writes episodes in robomimic's layout (https://robomimic.github.io/docs/datasets/overview.html):
/// data/demo_N with actions, rewards, dones, states (empty), obs/KEY and next_obs/KEY; mask/train,
/// mask/valid. The hands that are there in all episodes act. Each of R rows but the last one is a sample.
/// @param pictures files of all episodes' rows, one after another; empty: none. As obs/endoscope_image
/// @return samples with an action beyond [−1, 1]
/// @throws std::invalid_argument where no hand is in all episodes, or one has fewer than 2 rows;
/// std::runtime_error naming what could not be written
std::size_t writeHdf5(const std::string& file, const std::vector<Episode>& episodes,
                      const std::vector<std::string>& pictures);

}  // namespace vest::data
