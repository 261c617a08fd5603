/// Plane sections of a volume in grey.
#pragma once

#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "vest_tissue/volume/brick.h"
#include "vest_viz/inspect/slice.h"

namespace vest::volume {

/// Which values are seen: from `level` - width / 2, black, to `level` + width / 2, white.
struct Window {
  double level = 40, width = 400;  ///< HU, or the unit of the image; width ≥ 1
};

/// Grey, 0 … 255, as DICOM's linear function has it (PS3.3, C.11.2.1.2.1).
std::uint8_t grey(double value, const Window& window);

/// A rectangle in a plane, in pixels. The middle of pixel (column, row) is at
/// corner + (column + 0.5)·right + (row + 0.5)·down.
struct Section {
  Eigen::Vector3d corner = Eigen::Vector3d::Zero();                                 ///< m, world
  Eigen::Vector3d right = Eigen::Vector3d::Zero(), down = Eigen::Vector3d::Zero();  ///< m a pixel
  int width = 0, height = 0;       ///< pixels; 0: the plane does not meet the volume
  std::vector<std::uint8_t> rgba;  ///< alpha 255; 0 outside of the volume and where nothing was measured
};

/// What a plane cuts of a volume: the rectangle round it, pixels as fine as the finest voxels, or coarser so
/// that there are at most `most` along an edge. Values are trilinear.
Section section(const Brick& brick, const inspect::Plane& plane, const Window& window, int most = 512);

}  // namespace vest::volume
