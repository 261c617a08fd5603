#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "series.h"
#include "volume_file.h"
#include "worker.h"

namespace vest::image {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

[[noreturn]] void refuse(const std::string& path, const std::string& cause) {
  throw std::invalid_argument(path + ": " + cause);
}

/// Size, place and axes that a header says.
Volume gridOf(const std::string& path, const VolumeHeader& h) {
  Volume volume;
  double voxels = 1;
  for (int a = 0; a < 3; ++a) {
    if (h.size[a] == 0) refuse(path, "size: an axis has no voxel");
    volume.size[a] = h.size[a], voxels *= h.size[a];
  }
  if (!(voxels <= static_cast<double>(kMostVoxels))) refuse(path, "size: more than 2^28 voxels");
  if (h.width == 0 || h.width > 8) refuse(path, "has a type of number that is not read");
  if (voxels > static_cast<double>(h.values))
    refuse(path, "is damaged: it ends before the last value, or its size is wrong");
  Matrix3d direction;
  for (int a = 0; a < 3; ++a) {
    if (!(h.spacing[a] > 0 && h.spacing[a] <= 1000))
      refuse(path, "spacing: must be above 0, at most 1000 mm");
    if (!(std::abs(h.origin[a]) <= 1e5)) refuse(path, "origin: must lie within 100 m");
    for (int r = 0; r < 3; ++r) direction(r, a) = h.direction[r][a];
  }
  if (!direction.allFinite() || (direction.colwise().norm().array() - 1).abs().maxCoeff() > 1e-3 ||
      std::abs(direction.determinant()) < 0.1)
    refuse(path, "direction: must be three axes of space");
  if (std::abs(direction.col(0).dot(direction.col(1))) > 1e-4)
    refuse(path, "direction: rows and columns must be at right angles");
  volume.axes = 1e-3 * direction * Vector3d(h.spacing[0], h.spacing[1], h.spacing[2]).asDiagonal();
  volume.origin = 1e-3 * Vector3d(h.origin[0], h.origin[1], h.origin[2]);
  volume.axes.array() += 0.0, volume.origin.array() += 0.0;  // -0 of turned axes is 0
  return volume;
}

}  // namespace

Volume readVolumeFile(const std::string& path) {
  const auto memory = sharedMemory(sizeof(VolumeHeader));
  auto& shared = *static_cast<VolumeHeader*>(memory.get());
  inWorker({path}, [&](std::size_t) { shared = readVolumeHeader(path); });
  const VolumeHeader header = shared;
  Volume volume = gridOf(path, header);
  if (!header.placed)
    volume.notes.push_back("axes are assumed: the file does not say how the patient lies in it");
  const std::size_t layer = volume.layer(), voxels = layer * volume.size[2];
  if (header.values > voxels)
    volume.notes.push_back("holds " + std::to_string(header.values - voxels) +
                           " more values than its size says: they are not read");
  // Slices run along row × column, as those of DICOM.
  const bool reversed = volume.axes.determinant() < 0;
  if (reversed) {
    volume.origin += (volume.size[2] - 1.0) * volume.axes.col(2);
    volume.axes.col(2) *= -1;
  }
  const auto kinds = sharedMemory(sizeof(ValueKind)), values = sharedMemory(voxels * sizeof(float));
  auto& told = *static_cast<ValueKind*>(kinds.get());
  inWorker(
      {path}, [&](std::size_t) { told = readValues(path, header, reversed, values.get()); },
      voxels * header.width);
  const ValueKind kind = told;
  if (kind.whole)
    volume.whole = {values, static_cast<const std::int16_t*>(values.get())};
  else
    volume.real = {values, static_cast<const float*>(values.get())};
  if (kind.nothing > 0)
    volume.notes.push_back(std::to_string(kind.nothing) + " values are no numbers: they are padding");
  for (std::uint32_t k = 0; k < volume.size[2]; ++k) {
    Slice slice;
    slice.position = volume.origin + k * volume.axes.col(2);
    slice.file = path;
    if (kind.nothing > 0) slice.padding_low = slice.padding_high = kind.padding;
    volume.slices.push_back(std::move(slice));
  }
  return volume;
}

}  // namespace vest::image
