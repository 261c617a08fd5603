/// From a patient's image to what a hand feels in it (voxel/law.h): a smoothed copy on an even grid.
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "vest_tissue/volume/brick.h"
#include "vest_tissue/volume/transfer_table.h"
#include "vest_tissue/voxel/volume.h"

namespace vest::volume {

inline constexpr std::size_t kMostFeelBytes = std::size_t{64} << 20;  ///< of all voxels
inline constexpr double kProbeRadius = 0.002;  ///< m, the one that a table's stiffness is for

struct FeelOptions {
  double spacing = 0.001;          ///< m; more where the image is too large for kMostFeelBytes
  double smoothing = 0.001;        ///< m, standard deviation; more where the table is too steep for it
  double full = 3.3;               ///< N: what a device shows at most (a PHANToM's; Massie, Salisbury 1994)
  double needle_stiffness = 1000;  ///< N/m
  double surface = -500;           ///< value of the surface that a probe rests on
  std::vector<double> capsules;    ///< N, of regions from 1
  /// Region of a voxel, 0 … 31: at a place of world, m, with this smoothed value. Empty: none anywhere.
  std::function<std::uint8_t(const Eigen::Vector3d& place, double value)> region;
};

/// Resamples, smooths, and checks that at 20 mm/s no yield changes by more than 4 % of `full` in a
/// millisecond. If it does, all is smoothed more, up to 4 mm, and a note says so.
/// @throws std::invalid_argument: a table without columns for the hand, whose first row resists, or that is
/// too steep even so
std::shared_ptr<const voxel::Volume> makeFeelable(const Brick& brick, const TransferTable& table,
                                                  const FeelOptions& options);

}  // namespace vest::volume
