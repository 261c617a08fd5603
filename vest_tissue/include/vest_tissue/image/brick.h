/// A patient's images, placed in the world and small enough to be sent.
#pragma once

#include <Eigen/Core>

#include "vest_tissue/image/volume.h"
#include "vest_tissue/volume/brick.h"

namespace vest::image {

inline constexpr std::size_t kMostBrickBytes = std::size_t{64} << 20;  ///< of its values

using volume::supine;

/// The volume, supine. Whole numbers stay what they are; others are spread over 16 bits. Padding becomes
/// Brick::kNothing. A volume above `most` bytes is reduced by whole factors, those axes first whose voxels
/// are shortest: a voxel is then the mean of those that it covers.
/// @param place m, world: where the middle of the block's underside comes to lie
volume::Brick toBrick(const Volume& volume, const Eigen::Vector3d& place, std::size_t most = kMostBrickBytes);

/// XXH64 in hexadecimal over size, origin, axes and all values as they were read, little-endian.
std::string hash(const Volume& volume);

}  // namespace vest::image
