#include "vest_tissue/image/volume.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <boost/crc.hpp>
#include <cmath>

namespace vest::image {
namespace {

Statistics over(const Volume& volume, std::size_t from, std::size_t end) {
  Statistics s;
  double sum = 0;
  for (std::size_t v = from; v < end; ++v) {
    if (volume.padding(v)) continue;
    const double value = volume.value(v);
    s.min = s.count == 0 ? value : std::min(s.min, value);
    s.max = s.count == 0 ? value : std::max(s.max, value);
    sum += value;
    ++s.count;
  }
  if (s.count > 0) s.mean = sum / static_cast<double>(s.count);
  return s;
}

}  // namespace

double Volume::tilt() const {
  const Eigen::Vector3d normal = axes.col(0).cross(axes.col(1)), step = axes.col(2);
  return std::atan2(normal.cross(step).norm(), std::abs(normal.dot(step)));
}

std::optional<std::size_t> Volume::nearest(const Eigen::Vector3d& place) const {
  const Eigen::Vector3d grid = axes.inverse() * (place - origin);
  std::size_t voxel[3];
  for (int a = 0; a < 3; ++a) {
    const double rounded = std::floor(grid[a] + 0.5);
    if (!(rounded >= 0 && rounded < size[a])) return {};
    voxel[a] = static_cast<std::size_t>(rounded);
  }
  return (voxel[2] * size[1] + voxel[1]) * size[0] + voxel[0];
}

Statistics statistics(const Volume& volume) {
  return over(volume, 0, volume.voxels());
}

Statistics statistics(const Volume& volume, std::uint32_t slice) {
  return over(volume, slice * volume.layer(), (slice + 1) * volume.layer());
}

std::uint32_t checksum(const Volume& volume, std::uint32_t slice) {
  boost::crc_32_type crc;
  const std::size_t from = slice * volume.layer();
  for (std::size_t v = from; v < from + volume.layer(); ++v) {
    const double value = std::nearbyint(std::clamp(volume.value(v), -32768.0, 32767.0));
    const auto bits = static_cast<std::uint16_t>(static_cast<std::int16_t>(value));
    const unsigned char bytes[] = {static_cast<unsigned char>(bits), static_cast<unsigned char>(bits >> 8)};
    crc.process_bytes(bytes, 2);
  }
  return crc.checksum();
}

}  // namespace vest::image
