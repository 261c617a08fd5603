#include "vest_tissue/image/brick.h"

#include <xxhash.h>
#include <cmath>
#include <cstdio>

namespace vest::image {
namespace {

using volume::Brick;

/// Of how many voxels along each axis one is made.
std::array<std::uint32_t, 3> factors(const Volume& volume, std::size_t most) {
  std::array<std::uint32_t, 3> f{1, 1, 1};
  const Eigen::Vector3d spacing = volume.spacing();
  const auto bytes = [&] {
    std::size_t n = sizeof(std::int16_t);
    for (int a = 0; a < 3; ++a) n *= volume.size[a] / f[a] + (volume.size[a] % f[a] != 0 ? 1 : 0);
    return n;
  };
  while (bytes() > most) {
    int shortest = -1;
    for (int a = 0; a < 3; ++a)
      if (f[a] < volume.size[a] && (shortest < 0 || f[a] * spacing[a] < f[shortest] * spacing[shortest]))
        shortest = a;
    if (shortest < 0) break;
    ++f[shortest];
  }
  return f;
}

}  // namespace

Brick toBrick(const Volume& from, const Eigen::Vector3d& place, std::size_t most) {
  const auto f = factors(from, most);
  Brick to;
  to.unit = from.unit;
  to.reduced = f;
  Eigen::Vector3d shift;
  for (int a = 0; a < 3; ++a) {
    to.size[a] = (from.size[a] + f[a] - 1) / f[a];
    to.axes.col(a) = f[a] * (supine() * from.axes.col(a));
    shift[a] = 0.5 * (f[a] - 1);
  }
  to.origin = supine() * (from.origin + from.axes * shift);
  if (!from.whole) {
    const Statistics s = statistics(from);
    to.slope = s.max > s.min ? (s.max - s.min) / 65534 : 1;
    to.intercept = s.max > s.min ? 0.5 * (s.min + s.max) : s.min;
  }
  to.stored.resize(to.voxels());
  std::size_t voxel = 0;
  for (std::uint32_t k = 0; k < from.size[2]; k += f[2])
    for (std::uint32_t j = 0; j < from.size[1]; j += f[1])
      for (std::uint32_t i = 0; i < from.size[0]; i += f[0], ++voxel) {
        double sum = 0;
        int count = 0;
        for (std::uint32_t c = k; c < std::min(k + f[2], from.size[2]); ++c)
          for (std::uint32_t b = j; b < std::min(j + f[1], from.size[1]); ++b)
            for (std::uint32_t a = i; a < std::min(i + f[0], from.size[0]); ++a) {
              const std::size_t v = (std::size_t{c} * from.size[1] + b) * from.size[0] + a;
              if (from.padding(v)) continue;
              sum += from.value(v);
              ++count;
            }
        const double number = count > 0 ? (sum / count - to.intercept) / to.slope : 0;
        to.stored[voxel] = count > 0
                               ? static_cast<std::int16_t>(std::lround(std::clamp(number, -32767.0, 32767.0)))
                               : Brick::kNothing;
      }
  Eigen::Vector3d low = Eigen::Vector3d::Constant(1e300), high = -low;
  for (int corner = 0; corner < 8; ++corner) {
    Eigen::Vector3d grid;
    for (int a = 0; a < 3; ++a) grid[a] = (corner >> a & 1) != 0 ? from.size[a] - 0.5 : -0.5;
    const Eigen::Vector3d p = supine() * (from.origin + from.axes * grid);
    low = low.cwiseMin(p), high = high.cwiseMax(p);
  }
  to.origin += place - Eigen::Vector3d(0.5 * (low[0] + high[0]), 0.5 * (low[1] + high[1]), low[2]);
  return to;
}

std::string hash(const Volume& volume) {
  XXH64_state_t* const state = XXH64_createState();
  XXH64_reset(state, 0);
  XXH64_update(state, volume.size.data(), sizeof volume.size);
  XXH64_update(state, volume.origin.data(), 3 * sizeof(double));
  XXH64_update(state, volume.axes.data(), 9 * sizeof(double));
  if (volume.whole)
    XXH64_update(state, volume.whole.get(), volume.voxels() * sizeof(std::int16_t));
  else
    XXH64_update(state, volume.real.get(), volume.voxels() * sizeof(float));
  char text[17];
  std::snprintf(text, sizeof text, "%016llx", static_cast<unsigned long long>(XXH64_digest(state)));
  XXH64_freeState(state);
  return text;
}

}  // namespace vest::image
