#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

namespace vest::volume {

/// A labelled image: what of the body each voxel is. Voxel (i, j, k) is centred at
/// origin + direction·(i·spacing_x, j·spacing_y, k·spacing_z); i runs fastest in `labels`.
struct LabelledImage {
  std::array<std::uint32_t, 3> size{};                      ///< voxels
  Eigen::Vector3d spacing = Eigen::Vector3d::Ones();        ///< m
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();         ///< m, world: centre of voxel (0, 0, 0)
  Eigen::Matrix3d direction = Eigen::Matrix3d::Identity();  ///< columns: axes, orthonormal
  std::vector<std::uint16_t> labels;                        ///< 0: nothing

  std::uint16_t at(std::uint32_t i, std::uint32_t j, std::uint32_t k) const {
    return labels[(static_cast<std::size_t>(k) * size[1] + j) * size[0] + i];
  }
  /// Label of the voxel that holds a point given in the image's axes (m from the origin); 0 outside.
  std::uint16_t nearest(const Eigen::Vector3d& place) const;
};

}  // namespace vest::volume
