/// A patient's images as one grid of values. No ROS, no DICOM here.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

namespace vest::image {

inline constexpr std::size_t kMostVoxels = std::size_t{1} << 28;  ///< of a volume

/// One layer of the grid along its third axis.
struct Slice {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< m: centre of its first voxel
  /// Values within these bounds say that nothing was measured there; none where low > high.
  double padding_low = 1, padding_high = 0;
  std::string file;  ///< where it came from
};

/// What has been measured in a block of a patient. Lengths in metres, places in the axes of DICOM: x to the
/// patient's left, y to the back, z to the head (DICOM PS3.3, C.7.6.2.1.1). Voxel (i, j, k) is centred at
/// origin + axes·(i, j, k). i, the columns of a picture, runs fastest. Values never change once read.
struct Volume {
  std::string modality;                                ///< DICOM's term (CT, MR …); empty: not known
  std::string unit;                                    ///< "HU" where a rescaled CT says so, else empty
  std::string photometric;                             ///< DICOM's term: MONOCHROME1 shows low values bright
  std::array<std::uint32_t, 3> size{};                 ///< columns, rows, slices
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();    ///< m: centre of voxel (0, 0, 0)
  Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();  ///< columns: m from voxel to voxel; may be sheared
  std::vector<Slice> slices;                           ///< size[2] of them
  bool resampled = false;                              ///< values were interpolated onto this grid
  std::vector<std::string> notes;                      ///< what a reader has to say about the files
  /// One of both is there: whole numbers of 16 bits, or single precision where those do not hold the values.
  std::shared_ptr<const std::int16_t> whole;
  std::shared_ptr<const float> real;

  std::size_t layer() const { return std::size_t{size[0]} * size[1]; }  ///< voxels of a slice
  std::size_t voxels() const { return layer() * size[2]; }
  double value(std::size_t voxel) const { return whole ? whole.get()[voxel] : real.get()[voxel]; }
  bool padding(std::size_t voxel) const {
    const Slice& slice = slices[voxel / layer()];
    const double v = value(voxel);
    return slice.padding_low <= v && v <= slice.padding_high;
  }
  Eigen::Vector3d spacing() const { return axes.colwise().norm(); }  ///< m
  Eigen::Matrix3d direction() const { return axes.colwise().normalized(); }
  /// Angle between the third axis and the normal of the slices, rad; 0 of a grid without shear.
  double tilt() const;
  /// Number of the voxel whose centre is nearest in grid coordinates; none outside of the grid. @param place
  /// m
  std::optional<std::size_t> nearest(const Eigen::Vector3d& place) const;
};

/// Of all values but padding.
struct Statistics {
  double min = 0, max = 0, mean = 0;
  std::size_t count = 0;  ///< 0: nothing but padding
};
Statistics statistics(const Volume& volume);
Statistics statistics(const Volume& volume, std::uint32_t slice);

/// CRC-32 (ISO-HDLC, as zlib's) of a slice's values as little-endian 16-bit numbers, row by row. Values in
/// single precision are rounded, and those beyond 16 bits become the nearest that fits.
std::uint32_t checksum(const Volume& volume, std::uint32_t slice);

struct ReadOptions {
  std::string series;  ///< which of several: number in the list of a refusal, or series instance UID
  bool resample =
      false;  ///< slices at uneven distances or sheared: interpolated onto an even, right-angled grid
};

/// A folder or a file of DICOM, or a file of NRRD, MetaImage or NIfTI by its ending. It is read in a process
/// of its own, whose death is a message. Slices are ordered by their place. What is no regular grid is
/// refused, or interpolated where `resample` says so.
/// @throws std::invalid_argument: one line with the cause and a file
Volume read(const std::string& path, const ReadOptions& options = {});

/// NRRD (.nrrd) or MetaImage (.mha) by the ending. @throws std::invalid_argument: another ending, a file that
/// cannot be written, sheared axes in a MetaImage (its readers take them for right-angled)
void write(const Volume& volume, const std::string& path);

}  // namespace vest::image
