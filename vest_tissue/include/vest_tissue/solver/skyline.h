#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

namespace vest::solver {

/// Symmetric positive definite matrix of 3×3 blocks in envelope storage, factored as L·D·L^T in double
/// without pivoting (George and Liu 1981, Computer Solution of Large Sparse Positive Definite Systems,
/// chapter 4). The order of every sum is fixed: the same bits on every machine. Only the constructor
/// allocates.
class Skyline {
 public:
  /// @param knots most block rows; @param entries most scalars below the diagonal
  Skyline(std::size_t knots, std::size_t entries);

  /// Sets the envelope: first[i] <= i is the first block column of block row i. All entries become zero.
  /// False (and no matrix) if it needs more than the room given at construction. Real-time safe.
  bool shape(const std::uint32_t* first, std::size_t knots);
  static std::size_t entriesOf(const std::uint32_t* first, std::size_t knots);

  void clear();
  /// Adds to block (i, j), j <= i; what lies outside the envelope is the caller's error. Of a diagonal block
  /// the lower triangle is used.
  void add(std::size_t i, std::size_t j, const Eigen::Matrix3d& block);
  /// False if a pivot is not positive: then the matrix is not positive definite in double precision.
  bool factor();
  /// b becomes A^-1·b; three scalars per knot.
  void solve(double* b) const;
  std::size_t knots() const { return rows_ / 3; }

 private:
  double* row(std::size_t r) { return values_.data() + start_[r] - first_[r]; }  ///< indexed by column
  const double* row(std::size_t r) const { return values_.data() + start_[r] - first_[r]; }
  std::vector<double> values_, diagonal_;
  std::vector<std::size_t> start_;
  std::vector<std::uint32_t> first_;  ///< per scalar row
  std::size_t rows_ = 0;
};

}  // namespace vest::solver
