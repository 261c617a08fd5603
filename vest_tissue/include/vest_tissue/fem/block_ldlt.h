#pragma once

#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include <Eigen/Core>

namespace vest::fem {

/// Symmetric positive definite matrix of 3×3 blocks, and its factor L D L^T.
/// The pattern is analysed at making (approximate minimum degree order), or in an order that is given;
/// factorise() and solve() allocate nothing. Up-looking method: Davis, Direct Methods for Sparse Linear
/// Systems, 2006, chapter 4, here on blocks. Why not Eigen's: docs/decisions/0017-finite-elements.md.
class BlockLdlt {
 public:
  BlockLdlt() = default;
  /// @param rows   number of block rows
  /// @param pairs  off-diagonal blocks (i, j), i != j, either order, repeats allowed
  /// @throws std::length_error where L has more than 5,000,000 blocks
  BlockLdlt(std::size_t rows, const std::vector<std::pair<std::uint32_t, std::uint32_t>>& pairs);

  /// Room for reorder(): rows, pairs (repeats count), off-diagonal blocks of L.
  void reserve(std::size_t rows, std::size_t pairs, std::size_t blocks);
  /// Another pattern, all zero, whose row i stands at place[i] of the order. Allocates nothing. False: no
  /// room, and nothing can be solved.
  bool reorder(const std::vector<std::uint32_t>& place,
               const std::vector<std::pair<std::uint32_t, std::uint32_t>>& pairs);
  std::uint32_t place(std::uint32_t row) const { return place_[row]; }  ///< in the order

  std::size_t rows() const { return diagonal_.size(); }
  std::size_t factorBlocks() const { return factor_row_.size(); }  ///< off-diagonal blocks of L

  /// Where block (i, j) is kept, and whether it is kept transposed. i == j: the diagonal.
  struct Slot {
    std::uint32_t index = 0;
    bool diagonal = false, transposed = false;
  };
  Slot slot(std::uint32_t i, std::uint32_t j) const;

  void setZero();
  void add(const Slot& slot, const Eigen::Matrix3d& block) {
    if (slot.diagonal)
      diagonal_[slot.index] += block;
    else if (slot.transposed)
      lower_[slot.index] += block.transpose();
    else
      lower_[slot.index] += block;
  }

  /// False where a pivot is not positive definite (or not finite): the factor is then unusable.
  bool factorise();

  /// In place, x = A^-1 x, 3·rows numbers in the caller's order. Not to be called from two threads at once.
  void solve(double* x);
  /// Same, columns at once; the bits of each column are those of solve(). column_stride >= 3·rows.
  void solveColumns(double* x, std::size_t columns, std::size_t column_stride);

 private:
  bool setPattern(const std::vector<std::pair<std::uint32_t, std::uint32_t>>& pairs, bool in_room);
  template <int W>
  void solveIn(double* work) const;
  std::vector<std::uint32_t> place_;      ///< caller's row -> permuted row
  std::vector<std::size_t> lower_start_;  ///< CSR by permuted row, columns < row
  std::vector<std::uint32_t> lower_column_;
  std::vector<Eigen::Matrix3d> lower_, diagonal_;
  std::vector<std::size_t> factor_start_;  ///< L by columns
  std::vector<std::uint32_t> factor_row_;
  std::vector<Eigen::Matrix3d> factor_, inverse_pivot_;
  std::vector<std::size_t> reach_start_;  ///< row pattern of L, ascending columns
  std::vector<std::uint32_t> reach_column_;
  std::vector<std::size_t> filled_;           ///< scratch: next entry of each column
  std::vector<std::uint32_t> parent_, seen_;  ///< scratch of the analysis: elimination tree, marks
  std::vector<Eigen::Matrix3d> row_;          ///< scratch
  std::vector<double> work_;                  ///< scratch of solve
};

}  // namespace vest::fem
