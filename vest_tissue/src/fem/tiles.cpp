#include "tiles.h"

#include <algorithm>

#include "product.h"
#include "vest_tissue/fem/workers.h"

namespace vest::fem {
namespace {

constexpr std::size_t kWide = Tiles::kWide, kSize = kWide * kWide;

void transpose(const double* from, double* to) {
  for (std::size_t i = 0; i < kWide; ++i)
    for (std::size_t j = 0; j < kWide; ++j) to[i * kWide + j] = from[j * kWide + i];
}

/// One tile, number by number: a <- -a^-1.
bool sweepTile(double* a) {
  double column[kWide];
  for (std::size_t k = 0; k < kWide; ++k) {
    const double pivot = a[k * kWide + k];
    if (!(pivot > 0.0)) return false;
    std::copy_n(a + k * kWide, kWide, column);
    for (std::size_t j = 0; j < kWide; ++j) {
      if (j == k) continue;
      const double factor = column[j] / pivot;
      double* const to = a + j * kWide;
      for (std::size_t i = 0; i < kWide; ++i) to[i] -= factor * column[i];
      to[k] = factor;
    }
    for (std::size_t i = 0; i < kWide; ++i) a[k * kWide + i] = column[i] / pivot;
    a[k * kWide + k] = -1.0 / pivot;
  }
  return true;
}

}  // namespace

bool sweep(Tiles& a, int threads, const std::function<void(double)>& done) {
  Workers workers(threads);
  const std::size_t count = a.count();
  std::vector<double> was(count * kSize), now(count * kSize);  // tiles of the pivot's columns
  for (std::size_t k = 0; k < count; ++k) {
    if (!sweepTile(a.tile(k, k))) return false;
    for (std::size_t i = 0; i < count; ++i) {
      if (i == k) continue;
      double *const w = was.data() + i * kSize, *const n = now.data() + i * kSize;
      if (i > k)
        std::copy_n(a.tile(i, k), kSize, w);
      else
        transpose(a.tile(k, i), w);
      std::fill_n(n, kSize, 0.0);
      // The pivot's tile is -D^-1 already, and symmetric.
      subtract({n, w, a.tile(k, k), kWide, kWide, kWide, kWide, kWide, kWide});
    }
    auto update = [&](std::size_t begin, std::size_t end) {
      for (std::size_t pair = begin; pair < end; ++pair) {
        const std::size_t i = pair / count, j = pair % count;
        if (j > i || i == k || j == k) continue;
        subtract({a.tile(i, j), now.data() + i * kSize, was.data() + j * kSize, kWide, kWide, kWide, kWide,
                  kWide, kWide});
      }
    };
    workers.forRanges(count * count, update);
    for (std::size_t i = 0; i < count; ++i) {
      if (i > k) std::copy_n(now.data() + i * kSize, kSize, a.tile(i, k));
      if (i < k) transpose(now.data() + i * kSize, a.tile(k, i));
    }
    if (done) done(static_cast<double>(k + 1) / static_cast<double>(count));
  }
  return true;
}

}  // namespace vest::fem
