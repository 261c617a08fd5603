#pragma once

#include <vector>

#include <Eigen/Core>

namespace vest::suture {

using Vector6 = Eigen::Matrix<double, 6, 1>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;

/// Symmetric positive definite matrix of 6×6 blocks, one beside the diagonal, with corner blocks where the
/// chain is closed; its Cholesky factor, solutions, and blocks of its inverse. Nothing allocates but the
/// constructor.
class BlockChain {
 public:
  BlockChain(std::size_t blocks, bool closed);

  std::size_t size() const { return diagonal.size(); }
  bool closed() const { return closed_; }
  void setZero();
  /// False where a pivot is not positive (or not finite): the factor is then unusable.
  bool factorise();
  /// In place, x = A⁻¹x.
  void solve(Vector6* x) const;

  /// Makes inverse() possible for the present factor: blocks on the diagonal of the inverse, and what leads
  /// from one to the next (two-sided recursion).
  void prepareInverse();
  /// Block (q, q) of the inverse; block (p, q), p < q, is transfer(p) times block (p + 1, q).
  const Matrix6& inverse(std::size_t q) const { return inverse_[q]; }
  const Matrix6& transfer(std::size_t p) const { return transfer_[p]; }
  /// What a closed chain adds to block (p, q) of the inverse, first three rows and columns.
  Eigen::Matrix3d around(std::size_t p, std::size_t q) const;

  std::vector<Matrix6> diagonal;  ///< A(i, i)
  std::vector<Matrix6> lower;     ///< A(i + 1, i); of the last one of a closed chain A(0, last)

 private:
  bool closed_;
  std::vector<Matrix6> root_;   ///< inverse of the Cholesky factor of each pivot
  std::vector<Matrix6> below_;  ///< L(i + 1, i)
  std::vector<Matrix6> last_;   ///< L(last, i), closed chains
  std::vector<Matrix6> transfer_, inverse_, to_last_;
};

}  // namespace vest::suture
