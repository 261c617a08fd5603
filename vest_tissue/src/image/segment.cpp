#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "vest_tissue/image/patient.h"

namespace vest::image {
namespace {

using Mask = std::vector<std::uint8_t>;

/// The grid that masks lie on.
struct Grid {
  std::array<std::uint32_t, 3> size;
  std::array<std::size_t, 3> stride;
  explicit Grid(const Volume& v) : size(v.size), stride{1, v.size[0], v.layer()} {}
  std::size_t voxels() const { return stride[2] * size[2]; }
  std::uint32_t at(std::size_t voxel, int axis) const {
    return static_cast<std::uint32_t>(voxel / stride[axis] % size[axis]);
  }
};

/// Sums over a line of 2·radius + 1 voxels along each axis in turn: the count in a cube; outside is `beyond`.
std::vector<std::uint32_t> countAround(const Grid& grid, const Mask& mask, std::uint32_t radius,
                                       bool beyond) {
  std::vector<std::uint32_t> sum(mask.begin(), mask.end()), line;
  std::uint32_t full = 1;  // what a voxel outside counts by now
  for (int axis = 0; axis < 3; ++axis) {
    const std::size_t n = grid.size[axis], stride = grid.stride[axis];
    line.resize(n + 2 * radius);
    for (std::size_t first = 0; first < sum.size(); ++first) {
      if (grid.at(first, axis) != 0) continue;
      std::fill(line.begin(), line.end(), beyond ? full : 0);
      for (std::size_t i = 0; i < n; ++i) line[radius + i] = sum[first + i * stride];
      std::uint32_t running = 0;
      for (std::size_t i = 0; i < 2 * radius; ++i) running += line[i];
      for (std::size_t i = 0; i < n; ++i) {
        running += line[i + 2 * radius];
        sum[first + i * stride] = running;
        running -= line[i];
      }
    }
    full *= 2 * radius + 1;
  }
  return sum;
}

void median(const Grid& grid, std::uint32_t radius, Mask& mask) {
  const auto count = countAround(grid, mask, radius, false);
  const std::uint32_t cube = (2 * radius + 1) * (2 * radius + 1) * (2 * radius + 1);
  for (std::size_t v = 0; v < mask.size(); ++v) mask[v] = 2 * count[v] > cube;
}

void closing(const Grid& grid, std::uint32_t radius, Mask& mask) {
  const std::uint32_t cube = (2 * radius + 1) * (2 * radius + 1) * (2 * radius + 1);
  const auto near = countAround(grid, mask, radius, false);
  for (std::size_t v = 0; v < mask.size(); ++v) mask[v] = near[v] > 0;
  const auto all = countAround(grid, mask, radius, true);
  for (std::size_t v = 0; v < mask.size(); ++v) mask[v] = all[v] == cube;
}

/// Voxels connected to one, through faces; they leave the mask.
std::vector<std::size_t> takePart(const Grid& grid, std::size_t from, Mask& mask) {
  std::vector<std::size_t> part{from};
  mask[from] = 0;
  for (std::size_t next = 0; next < part.size(); ++next) {
    const std::size_t v = part[next];
    for (int axis = 0; axis < 3; ++axis) {
      const std::uint32_t at = grid.at(v, axis);
      for (const bool up : {false, true}) {
        if (up ? at + 1 == grid.size[axis] : at == 0) continue;
        const std::size_t other = up ? v + grid.stride[axis] : v - grid.stride[axis];
        if (mask[other] != 0) mask[other] = 0, part.push_back(other);
      }
    }
  }
  return part;
}

void keepParts(std::vector<std::vector<std::size_t>> parts, std::size_t most, Mask& mask) {
  std::stable_sort(parts.begin(), parts.end(),
                   [](const auto& a, const auto& b) { return a.size() > b.size(); });
  std::fill(mask.begin(), mask.end(), std::uint8_t{0});
  for (std::size_t p = 0; p < std::min(most, parts.size()); ++p)
    for (const std::size_t v : parts[p]) mask[v] = 1;
}

Mask maskOf(const Volume& volume, const Grid& grid, const Patient& patient, const Segment& s) {
  Mask mask(grid.voxels(), 0);
  for (std::size_t v = 0; v < mask.size(); ++v) {
    const double value = volume.value(v);
    if (!(value >= s.low && value <= s.high) || volume.padding(v)) continue;
    mask[v] = 1;
    if (!patient.cropped) continue;
    const Eigen::Vector3d place =
        volume.origin + volume.axes * Eigen::Vector3d(grid.at(v, 0), grid.at(v, 1), grid.at(v, 2));
    mask[v] = (place.array() >= patient.low.array()).all() && (place.array() <= patient.high.array()).all();
  }
  if (s.median > 0) median(grid, s.median, mask);
  if (s.closing > 0) closing(grid, s.closing, mask);
  if (s.grows) {
    const auto seed = volume.nearest(s.from);
    if (!seed || mask[*seed] == 0)
      throw std::invalid_argument("labels: " + s.name + ": from: the label is not at this place");
    keepParts({takePart(grid, *seed, mask)}, 1, mask);
  }
  if (s.largest > 0) {
    std::vector<std::vector<std::size_t>> parts;
    for (std::size_t v = 0; v < mask.size(); ++v)
      if (mask[v] != 0) parts.push_back(takePart(grid, v, mask));
    keepParts(std::move(parts), s.largest, mask);
  }
  return mask;
}

}  // namespace

volume::LabelledImage segment(const Volume& volume, const Patient& patient) {
  volume::LabelledImage image;
  image.size = volume.size;
  image.spacing = volume.spacing();
  image.origin = volume.origin;
  image.direction = volume.direction();
  if (!(image.direction.transpose() * image.direction).isIdentity(1e-3))
    throw std::invalid_argument(patient.label_map.empty()
                                    ? "images: a tilted series has sheared axes; add resample: true"
                                    : "labels: the map has sheared axes: make it on resampled images");
  image.labels.assign(volume.voxels(), 0);
  const Grid grid(volume);
  for (std::size_t s = 0; s < patient.segments.size(); ++s) {
    const Mask mask = maskOf(volume, grid, patient, patient.segments[s]);
    if (std::find(mask.begin(), mask.end(), std::uint8_t{1}) == mask.end())
      throw std::invalid_argument("labels: " + patient.segments[s].name + ": no voxel is left of it");
    for (std::size_t v = 0; v < mask.size(); ++v)
      if (mask[v] != 0) image.labels[v] = static_cast<std::uint16_t>(s + 1);
  }
  return image;
}

}  // namespace vest::image
