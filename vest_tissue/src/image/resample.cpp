#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <stdexcept>

#include "series.h"
#include "worker.h"

namespace vest::image {
namespace {

using Eigen::Vector3d;

/// A slice seen from the right-angled grid.
struct Layer {
  double z;     ///< m along the normal
  double u, v;  ///< columns and rows that its first voxel is displaced by
};

/// Bilinear value of a slice; false where it has none, or padding beside it.
bool sample(const Volume& volume, std::size_t slice, double column, double row, double& value) {
  const double i0 = std::floor(column), j0 = std::floor(row);
  const double a = column - i0, b = row - j0;
  value = 0;
  for (int corner = 0; corner < 4; ++corner) {
    const double weight = ((corner & 1) != 0 ? a : 1 - a) * ((corner & 2) != 0 ? b : 1 - b);
    if (weight < 1e-9) continue;
    const double i = i0 + (corner & 1), j = j0 + (corner >> 1);
    if (i < 0 || j < 0 || i >= volume.size[0] || j >= volume.size[1]) return false;
    const std::size_t voxel =
        (slice * volume.size[1] + static_cast<std::size_t>(j)) * volume.size[0] + static_cast<std::size_t>(i);
    if (volume.padding(voxel)) return false;
    value += weight * volume.value(voxel);
  }
  return true;
}

template <class Value>
std::shared_ptr<const Value> fill(const Volume& from, const Volume& grid, const std::vector<Layer>& layers,
                                  double u0, double v0, Value nothing) {
  const auto memory = sharedMemory(grid.voxels() * sizeof(Value));
  auto* const values = static_cast<Value*>(memory.get());
  std::size_t below = 0, voxel = 0;
  const double step = grid.axes.col(2).norm();
  for (std::uint32_t k = 0; k < grid.size[2]; ++k) {
    const double z = layers[0].z + k * step;
    while (below + 2 < layers.size() && layers[below + 1].z <= z) ++below;
    const double t = std::clamp((z - layers[below].z) / (layers[below + 1].z - layers[below].z), 0.0, 1.0);
    for (std::uint32_t j = 0; j < grid.size[1]; ++j) {
      for (std::uint32_t i = 0; i < grid.size[0]; ++i, ++voxel) {
        double value = 0, one = 0;
        bool there = true;
        for (int side = 0; side < 2 && there; ++side) {
          const double weight = side == 0 ? 1 - t : t;
          if (weight < 1e-6) continue;
          const Layer& layer = layers[below + side];
          there = sample(from, below + side, i + u0 - layer.u, j + v0 - layer.v, one);
          value += weight * one;
        }
        if (!there)
          values[voxel] = nothing;
        else
          values[voxel] = std::is_same_v<Value, std::int16_t> ? static_cast<Value>(std::lround(value))
                                                              : static_cast<Value>(value);
      }
    }
  }
  return {memory, values};
}

/// Whole columns from the first to behind the last.
double rounded(double value, bool down) {
  if (std::abs(value - std::round(value)) < 1e-3) return std::round(value);
  return down ? std::floor(value) : std::ceil(value);
}

}  // namespace

Volume resampled(const Volume& from, const Spacing& spacing) {
  if (spacing.largest > 2 * (1 + kEven) * spacing.median)
    throw std::invalid_argument(spacing.cause + "; --resample bridges at most two distances");
  const Vector3d row = from.axes.col(0).normalized(), column = from.axes.col(1).normalized();
  const Vector3d normal = row.cross(column).normalized();
  const Vector3d unit = from.spacing();
  std::vector<Layer> layers;
  double low[2] = {0, 0}, high[2] = {0, 0};
  for (const Slice& slice : from.slices) {
    const Vector3d d = slice.position - from.origin;
    layers.push_back({normal.dot(d), row.dot(d) / unit[0], column.dot(d) / unit[1]});
    low[0] = std::min(low[0], layers.back().u), high[0] = std::max(high[0], layers.back().u);
    low[1] = std::min(low[1], layers.back().v), high[1] = std::max(high[1], layers.back().v);
  }
  const double u0 = rounded(low[0], true), v0 = rounded(low[1], true);
  const double wide = from.size[0] + rounded(high[0], false) - u0,
               tall = from.size[1] + rounded(high[1], false) - v0;
  const double deep = std::floor(layers.back().z / spacing.median + 1e-3) + 1;
  if (!(wide * tall * deep <= static_cast<double>(kMostVoxels)))
    throw std::invalid_argument(from.slices.front().file + ": resampled it has more than 2^28 voxels");
  Volume to;
  to.modality = from.modality, to.unit = from.unit, to.photometric = from.photometric, to.notes = from.notes;
  to.size = {static_cast<std::uint32_t>(wide), static_cast<std::uint32_t>(tall),
             static_cast<std::uint32_t>(deep)};
  to.axes.col(0) = from.axes.col(0), to.axes.col(1) = from.axes.col(1),
  to.axes.col(2) = spacing.median * normal;
  to.origin = from.origin + u0 * to.axes.col(0) + v0 * to.axes.col(1);
  to.resampled = true;
  const double nothing = from.whole ? -32768.0 : std::min(-32768.0, std::floor(statistics(from).min) - 1);
  for (std::uint32_t k = 0; k < to.size[2]; ++k) {
    Slice slice;
    slice.position = to.origin + k * to.axes.col(2);
    slice.padding_low = slice.padding_high = static_cast<float>(nothing);
    to.slices.push_back(slice);
  }
  if (from.whole)
    to.whole = fill<std::int16_t>(from, to, layers, u0, v0, static_cast<std::int16_t>(nothing));
  else
    to.real = fill<float>(from, to, layers, u0, v0, static_cast<float>(nothing));
  char text[160];
  std::snprintf(text, sizeof text, "resampled: %u slices onto %u, %.6g mm apart along their normal, linear",
                from.size[2], to.size[2], 1e3 * spacing.median);
  to.notes.push_back(text);
  if (!spacing.even) to.notes.push_back(spacing.cause);
  return to;
}

}  // namespace vest::image
