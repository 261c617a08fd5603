#pragma once

#include <algorithm>
#include <cstddef>
#include <cstring>

#include "product.h"

// Included once by the file of each processor level. In an unnamed namespace: each level's code stays in its
// own file. Every entry is the same sequence of multiplications and additions at each level.
namespace vest::fem::kernel {
namespace {

constexpr std::size_t kColumns = 4;  ///< of C in registers, beside two lanes of rows
constexpr std::size_t kBlock = 96;   ///< rows and columns of C whose factors are packed (tuned)
constexpr std::size_t kDepth = 192;  ///< of a packed part (tuned)

template <class Lane>
inline Lane load(const double* from) {
  Lane lane;
  std::memcpy(&lane, from, sizeof lane);
  return lane;
}

/// c -= a·b, packed: a is [k][two lanes], b is [k][kColumns].
template <class Lane>
inline void micro(double* c, std::size_t ldc, const double* a, const double* b, std::size_t depth) {
  constexpr std::size_t kLane = sizeof(Lane) / sizeof(double);
  Lane low[kColumns] = {}, high[kColumns] = {};
  for (std::size_t k = 0; k < depth; ++k) {
    const Lane a0 = load<Lane>(a + 2 * kLane * k);
    const Lane a1 = load<Lane>(a + 2 * kLane * k + kLane);
#pragma GCC unroll 4
    for (std::size_t j = 0; j < kColumns; ++j) {
      const double f = b[kColumns * k + j];
      low[j] += a0 * f;
      high[j] += a1 * f;
    }
  }
#pragma GCC unroll 4
  for (std::size_t j = 0; j < kColumns; ++j) {
    double* const at = c + j * ldc;
    const Lane first = load<Lane>(at) - low[j], second = load<Lane>(at + kLane) - high[j];
    std::memcpy(at, &first, sizeof first);
    std::memcpy(at + kLane, &second, sizeof second);
  }
}

/// Groups of `width` rows side by side for each k; zeros where there are no more.
inline void pack(double* out, const double* from, std::size_t ld, std::size_t rows, std::size_t depth,
                 std::size_t width) {
  for (std::size_t i = 0; i < rows; i += width) {
    const std::size_t count = std::min(width, rows - i);
    for (std::size_t k = 0; k < depth; ++k, out += width) {
      for (std::size_t r = 0; r < count; ++r) out[r] = from[i + r + k * ld];
      for (std::size_t r = count; r < width; ++r) out[r] = 0.0;
    }
  }
}

template <class Lane>
void subtractBy(const Product& p, double* room) {
  constexpr std::size_t kRows = 2 * sizeof(Lane) / sizeof(double);
  double* const a = room;
  double* const b = room + kBlock * kDepth;
  for (std::size_t k = 0; k < p.depth; k += kDepth) {
    const std::size_t depth = std::min(kDepth, p.depth - k);
    for (std::size_t j = 0; j < p.columns; j += kBlock) {
      const std::size_t columns = std::min(kBlock, p.columns - j);
      pack(b, p.b + j + k * p.ldb, p.ldb, columns, depth, kColumns);
      for (std::size_t i = 0; i < p.rows; i += kBlock) {
        const std::size_t rows = std::min(kBlock, p.rows - i);
        pack(a, p.a + i + k * p.lda, p.lda, rows, depth, kRows);
        for (std::size_t jj = 0; jj < columns; jj += kColumns) {
          for (std::size_t ii = 0; ii < rows; ii += kRows) {
            double* const c = p.c + i + ii + (j + jj) * p.ldc;
            const double *pa = a + ii * depth, *pb = b + jj * depth;
            if (ii + kRows <= rows && jj + kColumns <= columns) {
              micro<Lane>(c, p.ldc, pa, pb, depth);
              continue;
            }
            double edge[kRows * kColumns] = {};
            micro<Lane>(edge, kRows, pa, pb, depth);
            for (std::size_t x = 0; x < std::min(kColumns, columns - jj); ++x)
              for (std::size_t y = 0; y < std::min(kRows, rows - ii); ++y)
                c[y + x * p.ldc] += edge[y + x * kRows];
          }
        }
      }
    }
  }
}

}  // namespace
}  // namespace vest::fem::kernel
