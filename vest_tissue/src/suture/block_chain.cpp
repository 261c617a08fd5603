#include "vest_tissue/suture/block_chain.h"

#include <cmath>

#include "blocks.h"

namespace vest::suture {
namespace {

/// Inverse of the Cholesky factor of `a`, of which the lower triangle counts. False: not positive definite.
bool inverseRoot(const Matrix6& a, Matrix6& out) {
  // L·D·Lᵀ column by column; what each does to the rows, M takes along from the identity: M = L⁻¹. A root in
  // the column would make the next one wait for it.
  double left[6][6], m[6][6], inverse[6];
  for (int j = 0; j < 6; ++j)
    for (int i = 0; i < 6; ++i) left[j][i] = a(i, j), m[j][i] = i == j ? 1.0 : 0.0;
  for (int j = 0; j < 6; ++j) {
    const double d = left[j][j];
    if (!(d > 0.0) || !(d < 1e300)) return false;
    inverse[j] = 1.0 / d;
    double l[6];
    for (int i = j + 1; i < 6; ++i) l[i] = left[j][i] * inverse[j];
    for (int k = j + 1; k < 6; ++k)
      for (int i = k; i < 6; ++i) left[k][i] -= l[i] * left[j][k];
    for (int k = 0; k <= j; ++k)
      for (int i = j + 1; i < 6; ++i) m[k][i] -= l[i] * m[k][j];
  }
  for (int i = 0; i < 6; ++i) inverse[i] = std::sqrt(inverse[i]);
  for (int j = 0; j < 6; ++j)
    for (int i = 0; i < 6; ++i) out(i, j) = i < j ? 0.0 : m[j][i] * inverse[i];
  return true;
}

}  // namespace

BlockChain::BlockChain(std::size_t blocks, bool closed) : closed_(closed) {
  for (auto* v : {&diagonal, &lower, &root_, &below_, &transfer_, &inverse_})
    v->resize(blocks, Matrix6::Zero());
  if (closed) last_.resize(blocks, Matrix6::Zero()), to_last_.resize(blocks, Matrix6::Zero());
}

void BlockChain::setZero() {
  for (auto& m : diagonal) m.setZero();
  for (auto& m : lower) m.setZero();
}

bool BlockChain::factorise() {
  const std::size_t n = size();
  prepared_ = n;
  Matrix6 pivot, end;
  if (closed_) end = diagonal[n - 1];
  for (std::size_t i = 0; i < n; ++i) {
    const bool at_end = closed_ && i + 1 == n;
    pivot = at_end ? end : diagonal[i];
    if (i > 0 && !at_end) subtractSquare(below_[i - 1], pivot);
    if (!inverseRoot(pivot, root_[i])) return false;
    if (i + 1 == n) break;
    const bool before_last = closed_ && i + 2 == n;
    if (!before_last) timesUpper(lower[i], root_[i], below_[i]);
    if (!closed_) continue;
    Matrix6 row = Matrix6::Zero();  // A(last, i) less what is eliminated
    if (i == 0) row = lower[n - 1].transpose();
    if (before_last) row += lower[i];
    if (i > 0) row.noalias() -= last_[i - 1] * below_[i - 1].transpose();
    last_[i].noalias() = row * root_[i].transpose();
    end.noalias() -= last_[i] * last_[i].transpose();
  }
  return true;
}

void BlockChain::solve(Vector6* x) const {
  const std::size_t n = size();
  const std::size_t plain = closed_ ? n - 1 : n;  // blocks that are chained by below_
  for (std::size_t i = 0; i < plain; ++i) {
    if (i > 0) x[i].noalias() -= below_[i - 1] * x[i - 1];
    x[i] = (root_[i] * x[i]).eval();
    if (closed_) x[n - 1].noalias() -= last_[i] * x[i];
  }
  if (closed_) x[n - 1] = (root_[n - 1].transpose() * (root_[n - 1] * x[n - 1])).eval();
  for (std::size_t i = plain; i-- > 0;) {
    if (i + 1 < plain) x[i].noalias() -= below_[i].transpose() * x[i + 1];
    if (closed_) x[i].noalias() -= last_[i].transpose() * x[n - 1];
    x[i] = (root_[i].transpose() * x[i]).eval();
  }
}

void BlockChain::prepareInverse(std::size_t from) {
  const std::size_t n = size(), plain = closed_ ? n - 1 : n;
  if (prepared_ <= from) return;
  for (std::size_t i = std::min(prepared_, plain); i-- > from;) {
    squareOf(root_[i], inverse_[i]);
    if (i + 1 == plain) continue;
    timesLower(below_[i], root_[i], transfer_[i]);
    addBetween(transfer_[i], inverse_[i + 1], inverse_[i]);
  }
  const bool first = prepared_ == n;
  prepared_ = from;
  if (!closed_ || !first) return;
  // A⁻¹ = [T⁻¹ 0; 0 0] + Y S⁻¹ Yᵀ, Y = (−T⁻¹b, 1) and S the last pivot: to_last_ holds Y·S^(−½).
  to_last_[n - 1] = root_[n - 1].transpose();
  for (std::size_t i = plain; i-- > 0;) {
    Matrix6 y = -(last_[i].transpose() * to_last_[n - 1]);
    if (i + 1 < plain) y.noalias() -= below_[i].transpose() * to_last_[i + 1];
    to_last_[i].noalias() = root_[i].transpose() * y;
  }
  inverse_[n - 1].setZero();
  transfer_[n - 2].setZero(), transfer_[n - 1].setZero();
}

void BlockChain::lead(std::size_t p, Matrix6& block) const {
  const Matrix6 next = block;
  minusTransposedTimes(transfer_[p], next, block);
}

Eigen::Matrix3d BlockChain::around(std::size_t p, std::size_t q) const {
  if (!closed_) return Eigen::Matrix3d::Zero();
  return to_last_[p].topRows<3>() * to_last_[q].topRows<3>().transpose();
}

}  // namespace vest::suture
