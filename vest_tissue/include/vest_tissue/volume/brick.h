/// A patient's image as pictures and devices take it: one grid of 16-bit numbers, placed in `world`.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include <Eigen/Core>

namespace vest::volume {

/// Voxel (i, j, k) is centred at origin + axes·(i, j, k); i runs fastest. Its cell reaches half a voxel to
/// each side of its centre.
struct Brick {
  static constexpr std::int16_t kNothing = -32768;  ///< stored where nothing was measured

  std::array<std::uint32_t, 3> size{};
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();    ///< m, world: centre of voxel (0, 0, 0)
  Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();  ///< columns: m from voxel to voxel; may be sheared
  double slope = 1, intercept = 0;                     ///< value = intercept + slope · stored
  std::string unit;                                    ///< of a value: "HU", or empty
  std::array<std::uint32_t, 3> reduced{1, 1, 1};  ///< voxels of the files that one covers, along each axis
  std::vector<std::int16_t> stored;

  std::size_t voxels() const { return std::size_t{size[0]} * size[1] * size[2]; }
  double value(std::int16_t number) const { return intercept + slope * number; }
};

/// From the patient's axes (left, posterior, superior) to those of `world`: on the back with right, feet and
/// front towards x, y and z; on the belly with left, feet and back towards them.
inline Eigen::Matrix3d supine() {
  return (Eigen::Matrix3d() << -1, 0, 0, 0, 0, -1, 0, -1, 0).finished();
}
inline Eigen::Matrix3d prone() {
  return (Eigen::Matrix3d() << 1, 0, 0, 0, 0, -1, 0, 1, 0).finished();
}

/// Trilinear between the centres of voxels, constant from the outermost ones outwards.
/// @param at grid coordinates: (i, j, k) at the centre of a voxel; within -0.5 … size - 0.5
/// @param number as stored, not rounded; of the neighbours that were measured alone
/// @return false: the nearest voxel was not measured
inline bool interpolate(const Brick& brick, const Eigen::Vector3f& at, float& number) {
  std::size_t low[3], step[3];
  float part[3];
  std::size_t stride = 1;
  for (int a = 0; a < 3; ++a) {
    const auto last = static_cast<float>(brick.size[a] - 1);
    const float x = std::min(std::max(at[a], 0.0f), last);
    const std::size_t i = std::min(static_cast<std::size_t>(x), std::size_t{std::max(brick.size[a], 2u) - 2});
    part[a] = x - static_cast<float>(i);
    low[a] = i * stride;
    step[a] = brick.size[a] > 1 ? stride : 0;
    stride *= brick.size[a];
  }
  const std::int16_t* const p = brick.stored.data() + low[0] + low[1] + low[2];
  const std::int16_t corner[8] = {
      p[0],       p[step[0]],           p[step[1]],           p[step[0] + step[1]],
      p[step[2]], p[step[0] + step[2]], p[step[1] + step[2]], p[step[0] + step[1] + step[2]]};
  if (*std::min_element(corner, corner + 8) == Brick::kNothing) {
    const int nearest = (part[0] >= 0.5f) + 2 * (part[1] >= 0.5f) + 4 * (part[2] >= 0.5f);
    if (corner[nearest] == Brick::kNothing) return false;
    float sum = 0, all = 0;
    for (int c = 0; c < 8; ++c) {
      if (corner[c] == Brick::kNothing) continue;
      const float weight = ((c & 1) != 0 ? part[0] : 1 - part[0]) * ((c & 2) != 0 ? part[1] : 1 - part[1]) *
                           ((c & 4) != 0 ? part[2] : 1 - part[2]);
      sum += weight * corner[c];
      all += weight;
    }
    number = sum / all;
    return true;
  }
  const auto mix = [](float a, float b, float t) { return a + t * (b - a); };
  number = mix(mix(mix(corner[0], corner[1], part[0]), mix(corner[2], corner[3], part[0]), part[1]),
               mix(mix(corner[4], corner[5], part[0]), mix(corner[6], corner[7], part[0]), part[1]), part[2]);
  return true;
}

}  // namespace vest::volume
