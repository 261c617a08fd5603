#pragma once

#include <cstddef>

namespace vest::fem {

/// C -= A·Bᵀ of dense matrices, each by columns; ld: from one column to the next. C: rows × columns, A: rows
/// × depth, B: columns × depth. C overlaps neither.
struct Product {
  double* c = nullptr;
  const double *a = nullptr, *b = nullptr;
  std::size_t ldc = 0, lda = 0, ldb = 0;
  std::size_t rows = 0, columns = 0, depth = 0;
};
/// The same bits on every processor: entries are summed over the depth in one order, without FMA.
void subtract(const Product& product);

namespace kernel {
constexpr std::size_t kRoom = 2 * 96 * 192;  ///< numbers that a level packs into
void subtractBaseline(const Product& product, double* room);
void subtractAvx2(const Product& product, double* room);
}  // namespace kernel

}  // namespace vest::fem
