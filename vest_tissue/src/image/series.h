/// From headers of frames to one series in order, and to its grid. No file is opened here.
#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

#include "dicom_file.h"
#include "vest_tissue/image/volume.h"

namespace vest::image {

/// Frames of one grid of pictures, ordered along row × column.
struct Series {
  std::vector<FrameHeader> frames;
  std::vector<std::string> notes;
};

Eigen::Vector3d positionOf(const FrameHeader& frame);  ///< m

/// The frames of the series that is asked for, or of the only one. What is no picture, and localizers, are
/// set aside. @throws std::invalid_argument: several series, or one that is no volume: cause and file
Series chooseSeries(const std::string& path, const std::vector<std::string>& files,
                    const std::vector<FrameHeader>& headers, const std::string& wanted);

/// Of ordered slices, no two at one place: whether they lie evenly on a line.
struct Spacing {
  double median = 0;  ///< m, along the line from slice to slice; 0 of a single slice
  bool even =
      true;  ///< every step within 1 % of the median one, no slice more than a tenth of it off its place
  std::string cause;   ///< where not even: what is wrong, between which files
  double largest = 0;  ///< m, along the normal
};
Spacing judgeSpacing(const Volume& volume);

inline constexpr double kEven = 0.01;  ///< part of the median distance that steps may differ by

/// Onto an even, right-angled grid: linear between neighbouring slices, and within them where they are
/// displaced. Where a value has no neighbour, or padding beside it, it is padding.
/// @throws std::invalid_argument: a gap of more than two distances
Volume resampled(const Volume& volume, const Spacing& spacing);

}  // namespace vest::image
