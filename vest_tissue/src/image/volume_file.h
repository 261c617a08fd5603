/// One file of NRRD, MetaImage or NIfTI, by ITK. readVolumeFile() is for callers, the rest for its
/// worker. Plain: ITK brings an Eigen of its own, so the two never meet in one file.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

namespace vest::image {

struct Volume;

/// What a file says about its grid, which is right only if checked. Plain: it passes through shared memory.
struct VolumeHeader {
  std::uint32_t size[3];
  double spacing[3], origin[3];  ///< mm; patient's axes as DICOM's
  double direction[3][3];        ///< [row][column]; columns are axes, of unit length
  std::uint32_t width;           ///< bytes of a value
  bool placed;                   ///< the file says how the patient lies in it
  std::size_t values;            ///< how many are there
};

/// By the ending: .nrrd, .nhdr, .mha, .mhd, .nii, .nii.gz
bool isVolumeFile(const std::string& path);

/// What read() makes of such a file, by a worker. @throws std::invalid_argument: FILE: cause
Volume readVolumeFile(const std::string& path);

/// @throws std::exception: no such file, or no volume of one number a voxel in mm
VolumeHeader readVolumeHeader(const std::string& path);

/// What the values of a file are.
struct ValueKind {
  bool whole;           ///< std::int16_t, else float
  std::size_t nothing;  ///< how many were no numbers; they are `padding` now
  float padding;
};

/// Reads all values. @param reversed the last slice comes first @param to room for a float a voxel: filled
/// with whole numbers where 16 bits hold all of them. @throws std::exception: damaged, or beyond ±1e30
ValueKind readValues(const std::string& path, const VolumeHeader& header, bool reversed, void* to);

}  // namespace vest::image
