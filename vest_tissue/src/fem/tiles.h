#pragma once

#include <cstddef>
#include <functional>
#include <vector>

#include "vest_tissue/fem/compliance.h"

namespace vest::fem {

/// A symmetric matrix of doubles while a Compliance is made: the same tiles, by columns. Those on the
/// diagonal are whole.
class Tiles {
 public:
  static constexpr std::size_t kWide = 3 * Compliance::kTile;  ///< numbers along a tile
  explicit Tiles(std::size_t nodes)
      : count_((nodes + Compliance::kTile - 1) / Compliance::kTile), numbers_(place(count_, 0), 0.0) {}
  std::size_t count() const { return count_; }
  double* tile(std::size_t row, std::size_t column) { return numbers_.data() + place(row, column); }
  /// Of unknowns row >= column, or both in a tile of the diagonal.
  double& at(std::size_t row, std::size_t column) {
    return tile(row / kWide, column / kWide)[column % kWide * kWide + row % kWide];
  }

 private:
  static std::size_t place(std::size_t row, std::size_t column) {
    return kWide * kWide * (row * (row + 1) / 2 + column);
  }
  std::size_t count_;
  std::vector<double> numbers_;
};

/// A <- -A^-1 of a positive definite matrix, in place, by the sweep operator on tiles (Goodnight 1979,
/// doi 10.1080/00031305.1979.10482685). The same bits for any number of threads.
/// @param done  told the share of the work, 0 … 1
/// @return false: a pivot is not positive
bool sweep(Tiles& a, int threads, const std::function<void(double)>& done);

}  // namespace vest::fem
