#include "vest_viz/texture/kept_texture.h"

#include <algorithm>

#include "vest_tissue/cache/block.h"

namespace vest::texture {

Baked bakeKept(const Style& style, int size, std::uint32_t seed, const std::string& directory) {
  if (directory.empty()) return bake(style, size, seed);
  // A small picture knows everything that a large one depends on, style and algorithm.
  constexpr int kSample = 32;
  const Baked sample = bake(style, kSample, seed);
  std::uint64_t content = cache::hash(sample.albedo.data(), sample.albedo.size(), seed);
  content =
      cache::hash(sample.relief.data(), sample.relief.size(), content + static_cast<std::uint64_t>(size));
  const std::string file = cache::path(directory, "texture", content);
  const auto n = static_cast<std::size_t>(size);
  const cache::Key key{content, n, n};
  std::vector<std::uint8_t> bytes(8 * n * n);
  const auto half = bytes.begin() + static_cast<std::ptrdiff_t>(4 * n * n);
  if (cache::load(file, key, bytes.data(), bytes.size())) {
    return {size, style.tile, {bytes.begin(), half}, {half, bytes.end()}};
  }
  const Baked baked = bake(style, size, seed);
  std::copy(baked.albedo.begin(), baked.albedo.end(), bytes.begin());
  std::copy(baked.relief.begin(), baked.relief.end(), half);
  cache::save(file, key, bytes.data(), bytes.size());
  return baked;
}

}  // namespace vest::texture
