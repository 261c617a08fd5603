#pragma once

#include <vector>

#include <Eigen/Core>

namespace vest::suture {

using Vector6 = Eigen::Matrix<double, 6, 1>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;

/// Symmetric positive definite matrix of 6×6 blocks, one beside the diagonal, with corner blocks where the
/// chain is closed; its Cholesky factor, solutions, and blocks of its inverse. The rotation of a node and the
/// place of the one before do not meet: the lower left quarter of A(i + 1, i) is zero. Nothing allocates but
/// the constructor.
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

  /// Makes inverse() and lead() possible for the present factor, from a block to the last (two-sided
  /// recursion). Work that is done is not done again.
  void prepareInverse(std::size_t from);
  /// Block (q, q) of the inverse, without what a closed chain adds.
  const Matrix6& inverse(std::size_t q) const { return inverse_[q]; }
  /// From what makes block (p + 1, q) of the inverse to what makes block (p, q), p < q.
  void lead(std::size_t p, Matrix6& block) const;
  /// What a closed chain adds to block (p, q) of the inverse, first three rows and columns.
  Eigen::Matrix3d around(std::size_t p, std::size_t q) const;

  std::vector<Matrix6> diagonal;  ///< A(i, i)
  std::vector<Matrix6> lower;     ///< A(i + 1, i); of the last one of a closed chain A(0, last)

 private:
  bool closed_;
  std::size_t prepared_ = 0;                           ///< first block of the inverse that is known
  std::vector<Matrix6> root_;                          ///< inverse of the Cholesky factor of each pivot
  std::vector<Matrix6> below_;                         ///< L(i + 1, i)
  std::vector<Matrix6> last_;                          ///< L(last, i), closed chains
  std::vector<Matrix6> transfer_, inverse_, to_last_;  ///< block (p, q) is −transfer_(p)ᵀ times (p + 1, q)
};

}  // namespace vest::suture
