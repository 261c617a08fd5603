#include "vest_tissue/suture/block_chain.h"

#include <cmath>

namespace vest::suture {
namespace {

/// Inverse of the Cholesky factor of `a`. False: not positive definite.
bool inverseRoot(const Matrix6& a, Matrix6& out) {
  Matrix6 l;
  for (int j = 0; j < 6; ++j) {
    double d = a(j, j);
    for (int k = 0; k < j; ++k) d -= l(j, k) * l(j, k);
    if (!(d > 0.0) || !(d < 1e300)) return false;
    const double root = std::sqrt(d), inverse = 1.0 / root;
    l(j, j) = inverse;  // kept inverted
    for (int i = j + 1; i < 6; ++i) {
      double s = a(i, j);
      for (int k = 0; k < j; ++k) s -= l(i, k) * l(j, k);
      l(i, j) = s * inverse;
    }
  }
  out.setZero();
  for (int j = 0; j < 6; ++j) {
    out(j, j) = l(j, j);
    for (int i = j + 1; i < 6; ++i) {
      double s = 0.0;
      for (int k = j; k < i; ++k) s -= l(i, k) * out(k, j);
      out(i, j) = s * l(i, i);
    }
  }
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
  Matrix6 pivot, end;
  if (closed_) end = diagonal[n - 1];
  for (std::size_t i = 0; i < n; ++i) {
    if (closed_ && i + 1 == n)
      pivot = end;
    else
      pivot = diagonal[i];
    if (i > 0 && !(closed_ && i + 1 == n)) pivot.noalias() -= below_[i - 1] * below_[i - 1].transpose();
    if (!inverseRoot(pivot, root_[i])) return false;
    if (i + 1 == n) break;
    const bool before_last = closed_ && i + 2 == n;
    if (!before_last) below_[i].noalias() = lower[i] * root_[i].transpose();
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

void BlockChain::prepareInverse() {
  const std::size_t n = size(), plain = closed_ ? n - 1 : n;
  for (std::size_t i = plain; i-- > 0;) {
    inverse_[i].noalias() = root_[i].transpose() * root_[i];
    if (i + 1 == plain) continue;
    transfer_[i].noalias() = -(root_[i].transpose() * below_[i].transpose());
    const Matrix6 half = transfer_[i] * inverse_[i + 1];
    inverse_[i].noalias() += half * transfer_[i].transpose();
  }
  if (!closed_) return;
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

Eigen::Matrix3d BlockChain::around(std::size_t p, std::size_t q) const {
  if (!closed_) return Eigen::Matrix3d::Zero();
  return to_last_[p].topRows<3>() * to_last_[q].topRows<3>().transpose();
}

}  // namespace vest::suture
