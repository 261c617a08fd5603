#include "vest_tissue/image/phantom.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "worker.h"

namespace vest::image {
namespace {

using Eigen::Vector3d;

constexpr std::int16_t kAir = -1000;

Vector3d stepOf(const Phantom& p, const PhantomImage& o) {
  for (const auto n : o.size)
    if (n < 1 || n > 1024) throw std::invalid_argument("size: 1 … 1024 voxels along each axis are allowed");
  return (p.high - p.low).cwiseQuotient(Vector3d(o.size[0], o.size[1], o.size[2]));
}

/// Calls voxel(number, shape) in order.
template <class Each>
void walk(const Phantom& p, const PhantomImage& o, const Each& voxel) {
  const Vector3d step = stepOf(p, o), first = p.low + 0.5 * step;
  std::size_t number = 0;
  for (std::uint32_t k = 0; k < o.size[2]; ++k)
    for (std::uint32_t j = 0; j < o.size[1]; ++j)
      for (std::uint32_t i = 0; i < o.size[0]; ++i)
        voxel(number++, p.at(first + step.cwiseProduct(Vector3d(i, j, k))));
}

}  // namespace

Volume picture(const Phantom& phantom, const PhantomImage& options) {
  if (!(options.noise >= 0 && options.noise <= 1000))
    throw std::invalid_argument("noise: 0 … 1000 HU are allowed");
  Volume v;
  v.modality = "CT", v.unit = "HU", v.photometric = "MONOCHROME2";
  v.size = options.size;
  const Vector3d step = stepOf(phantom, options);
  v.axes = step.asDiagonal();
  v.origin = phantom.low + 0.5 * step;
  for (std::uint32_t k = 0; k < v.size[2]; ++k) {
    v.slices.emplace_back();
    v.slices.back().position = v.origin + k * v.axes.col(2);
  }
  const auto memory = sharedMemory(2 * v.voxels());
  auto* const values = static_cast<std::int16_t*>(memory.get());
  walk(phantom, options, [&](std::size_t i, const Shape* shape) {
    const double value = shape == nullptr ? kAir : shape->value;
    const double noise = options.noise > 0 ? options.noise * volume::nearlyGaussian(options.seed, i) : 0;
    values[i] = static_cast<std::int16_t>(std::clamp(std::nearbyint(value + noise), -1024.0, 3071.0));
  });
  v.whole = {memory, values};
  return v;
}

volume::LabelledImage labels(const Phantom& phantom, const PhantomImage& options) {
  volume::LabelledImage image;
  image.size = options.size;
  image.spacing = stepOf(phantom, options);
  image.origin = phantom.low + 0.5 * image.spacing;
  image.labels.resize(std::size_t{image.size[0]} * image.size[1] * image.size[2]);
  walk(phantom, options,
       [&](std::size_t i, const Shape* shape) { image.labels[i] = shape == nullptr ? 0 : shape->label; });
  return image;
}

}  // namespace vest::image
