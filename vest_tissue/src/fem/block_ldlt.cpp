#include "vest_tissue/fem/block_ldlt.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>

#include <Eigen/OrderingMethods>
#include <Eigen/SparseCore>

namespace vest::fem {
namespace {

constexpr std::uint32_t kNoRow = 0xffffffffu;
constexpr std::size_t kMostBlocks = 5000000;  // of L: 360 MB (assumed)

/// Inverse of a symmetric positive definite 3×3 block; false where a pivot is not positive.
bool invertPivot(const Eigen::Matrix3d& D, Eigen::Matrix3d& inverse) {
  const double d0 = D(0, 0);
  if (!(d0 > 0.0)) return false;
  const double l1 = D(1, 0) / d0, l2 = D(2, 0) / d0;
  const double d1 = D(1, 1) - l1 * D(1, 0);
  if (!(d1 > 1e-14 * D(1, 1))) return false;
  const double m = D(2, 1) - l2 * D(1, 0), l3 = m / d1;
  const double d2 = D(2, 2) - l2 * D(2, 0) - l3 * m;
  if (!(d2 > 1e-14 * D(2, 2)) || !std::isfinite(d0 + d1 + d2)) return false;
  // D^-1 = L^-T diag^-1 L^-1 with L^-1 = [1; -l1 1; l1 l3 - l2, -l3, 1]
  const double k = l1 * l3 - l2;
  inverse(2, 2) = 1.0 / d2;
  inverse(2, 1) = inverse(1, 2) = -l3 / d2;
  inverse(2, 0) = inverse(0, 2) = k / d2;
  inverse(1, 1) = 1.0 / d1 + l3 * l3 / d2;
  inverse(1, 0) = inverse(0, 1) = -l1 / d1 - l3 * k / d2;
  inverse(0, 0) = 1.0 / d0 + l1 * l1 / d1 + k * k / d2;
  return true;
}

}  // namespace

BlockLdlt::BlockLdlt(std::size_t rows, const std::vector<std::pair<std::uint32_t, std::uint32_t>>& pairs) {
  const int n = static_cast<int>(rows);
  // Order.
  place_.resize(rows);
  if (rows > 0) {
    std::vector<Eigen::Triplet<double, int>> entries;
    for (const auto& [i, j] : pairs) {
      entries.emplace_back(static_cast<int>(i), static_cast<int>(j), 1.0);
      entries.emplace_back(static_cast<int>(j), static_cast<int>(i), 1.0);
    }
    for (int i = 0; i < n; ++i) entries.emplace_back(i, i, 1.0);
    Eigen::SparseMatrix<double, Eigen::ColMajor, int> graph(n, n);
    graph.setFromTriplets(entries.begin(), entries.end());
    Eigen::PermutationMatrix<Eigen::Dynamic, Eigen::Dynamic, int> order;
    Eigen::AMDOrdering<int>()(graph, order);  // order.indices()[new] = old
    for (int k = 0; k < n; ++k)
      place_[static_cast<std::size_t>(order.indices()[k])] = static_cast<std::uint32_t>(k);
  }
  reserve(rows, 0, 0);
  setPattern(pairs, false);
}

void BlockLdlt::reserve(std::size_t rows, std::size_t pairs, std::size_t blocks) {
  place_.reserve(rows), diagonal_.reserve(rows), inverse_pivot_.reserve(rows), row_.reserve(rows);
  lower_start_.reserve(rows + 1), factor_start_.reserve(rows + 1), reach_start_.reserve(rows + 1);
  filled_.reserve(rows), parent_.reserve(rows), seen_.reserve(rows);
  work_.reserve(rows * 3 * 8);
  lower_column_.reserve(pairs), lower_.reserve(pairs);
  factor_row_.reserve(blocks), factor_.reserve(blocks), reach_column_.reserve(blocks);
}

bool BlockLdlt::reorder(const std::vector<std::uint32_t>& place,
                        const std::vector<std::pair<std::uint32_t, std::uint32_t>>& pairs) {
  if (place.size() > place_.capacity() || pairs.size() > lower_column_.capacity()) return false;
  place_.assign(place.begin(), place.end());
  return setPattern(pairs, true);
}

bool BlockLdlt::setPattern(const std::vector<std::pair<std::uint32_t, std::uint32_t>>& pairs, bool in_room) {
  const std::size_t rows = place_.size();
  // Lower pattern by permuted rows.
  lower_start_.assign(rows + 1, 0);
  for (const auto& [i, j] : pairs) ++lower_start_[std::max(place_[i], place_[j])];
  std::size_t sum = 0;
  for (std::size_t& start : lower_start_) sum += std::exchange(start, sum);
  lower_column_.resize(pairs.size());
  filled_.assign(lower_start_.begin(), lower_start_.end() - 1);
  for (const auto& [i, j] : pairs)
    lower_column_[filled_[std::max(place_[i], place_[j])]++] = std::min(place_[i], place_[j]);
  std::size_t kept = 0;
  for (std::size_t k = 0; k < rows; ++k) {
    const auto first = lower_column_.begin() + static_cast<std::ptrdiff_t>(lower_start_[k]),
               last = lower_column_.begin() + static_cast<std::ptrdiff_t>(filled_[k]);
    std::sort(first, last);
    lower_start_[k] = kept;
    kept = static_cast<std::size_t>(std::copy(first, std::unique(first, last),
                                              lower_column_.begin() + static_cast<std::ptrdiff_t>(kept)) -
                                    lower_column_.begin());
  }
  lower_start_[rows] = kept;
  lower_column_.resize(kept);
  lower_.assign(kept, Eigen::Matrix3d::Zero());
  diagonal_.assign(rows, Eigen::Matrix3d::Zero());
  // Elimination tree and row patterns of L.
  parent_.assign(rows, kNoRow), seen_.assign(rows, kNoRow);
  factor_start_.assign(rows + 1, 0);
  reach_start_.assign(1, 0);
  reach_column_.clear();
  for (std::uint32_t k = 0; k < rows; ++k) {
    seen_[k] = k;
    for (std::size_t p = lower_start_[k]; p < lower_start_[k + 1]; ++p) {
      for (std::uint32_t j = lower_column_[p]; seen_[j] != k; j = parent_[j]) {
        if (parent_[j] == kNoRow) parent_[j] = k;
        seen_[j] = k;
        if (in_room && reach_column_.size() == reach_column_.capacity()) return false;
        if (!in_room && reach_column_.size() == kMostBlocks)
          throw std::length_error(
              "its matrix has more than " + std::to_string(kMostBlocks) +
              " blocks of factor; allowed: fewer free nodes, or fewer neighbours of each");
        reach_column_.push_back(j);
        ++factor_start_[j];
      }
    }
    std::sort(reach_column_.begin() + static_cast<std::ptrdiff_t>(reach_start_.back()), reach_column_.end());
    reach_start_.push_back(reach_column_.size());
  }
  sum = 0;
  for (std::size_t& start : factor_start_) sum += std::exchange(start, sum);
  factor_row_.resize(sum);
  factor_.resize(sum);
  inverse_pivot_.resize(rows);
  filled_.assign(factor_start_.begin(), factor_start_.end() - 1);
  for (std::uint32_t k = 0; k < rows; ++k) {
    for (std::size_t p = reach_start_[k]; p < reach_start_[k + 1]; ++p)
      factor_row_[filled_[reach_column_[p]]++] = k;
  }
  row_.assign(rows, Eigen::Matrix3d::Zero());
  work_.resize(rows * 3 * 8);
  return true;
}

BlockLdlt::Slot BlockLdlt::slot(std::uint32_t i, std::uint32_t j) const {
  const std::uint32_t a = place_[i], b = place_[j];
  Slot s;
  if (a == b) {
    s.index = a;
    s.diagonal = true;
    return s;
  }
  const std::uint32_t row = std::max(a, b), column = std::min(a, b);
  const auto first = lower_column_.begin() + static_cast<std::ptrdiff_t>(lower_start_[row]);
  const auto last = lower_column_.begin() + static_cast<std::ptrdiff_t>(lower_start_[row + 1]);
  s.index = static_cast<std::uint32_t>(std::lower_bound(first, last, column) - lower_column_.begin());
  s.transposed = a < b;
  return s;
}

void BlockLdlt::setZero() {
  std::fill(lower_.begin(), lower_.end(), Eigen::Matrix3d::Zero());
  std::fill(diagonal_.begin(), diagonal_.end(), Eigen::Matrix3d::Zero());
}

bool BlockLdlt::factorise() {
  const std::size_t n = rows();
  std::copy(factor_start_.begin(), factor_start_.end() - 1, filled_.begin());
  for (std::size_t k = 0; k < n; ++k) {
    for (std::size_t p = lower_start_[k]; p < lower_start_[k + 1]; ++p) row_[lower_column_[p]] = lower_[p];
    Eigen::Matrix3d D = diagonal_[k];
    for (std::size_t r = reach_start_[k]; r < reach_start_[k + 1]; ++r) {
      const std::uint32_t j = reach_column_[r];
      const Eigen::Matrix3d Y = row_[j];
      row_[j].setZero();
      const std::size_t end = filled_[j];
      for (std::size_t p = factor_start_[j]; p < end; ++p) {
        row_[factor_row_[p]].noalias() -= Y.lazyProduct(factor_[p].transpose());
      }
      const Eigen::Matrix3d L = Y.lazyProduct(inverse_pivot_[j]);
      D.noalias() -= L.lazyProduct(Y.transpose());
      factor_[end] = L;
      filled_[j] = end + 1;
    }
    if (!invertPivot(D, inverse_pivot_[k])) {
      for (auto& block : row_) block.setZero();
      return false;
    }
  }
  return true;
}

namespace {

/// y -= L x (or L^T x) for W columns side by side; the same order of operations for every W.
template <int W, bool kTransposed>
inline void subtractProduct(const Eigen::Matrix3d& L, const double* __restrict x, double* __restrict y) {
  for (int i = 0; i < 3; ++i) {
    const double a = kTransposed ? L(0, i) : L(i, 0), b = kTransposed ? L(1, i) : L(i, 1),
                 c = kTransposed ? L(2, i) : L(i, 2);
    for (int w = 0; w < W; ++w) y[W * i + w] -= (a * x[w] + b * x[W + w]) + c * x[2 * W + w];
  }
}

}  // namespace

template <int W>
void BlockLdlt::solveIn(double* work) const {
  const std::size_t n = rows();
  for (std::size_t j = 0; j < n; ++j) {
    double x[3 * W];
    std::copy(work + 3 * W * j, work + 3 * W * (j + 1), x);
    if (std::all_of(x, x + 3 * W, [](double value) { return value == 0.0; })) continue;  // unit vectors
    for (std::size_t p = factor_start_[j]; p < factor_start_[j + 1]; ++p) {
      subtractProduct<W, false>(factor_[p], x, work + 3 * W * static_cast<std::size_t>(factor_row_[p]));
    }
  }
  for (std::size_t j = n; j-- > 0;) {
    double x[3 * W] = {};
    subtractProduct<W, false>(inverse_pivot_[j], work + 3 * W * j, x);  // x = -D^-1 y
    for (double& value : x) value = -value;
    for (std::size_t p = factor_start_[j]; p < factor_start_[j + 1]; ++p) {
      subtractProduct<W, true>(factor_[p], work + 3 * W * static_cast<std::size_t>(factor_row_[p]), x);
    }
    std::copy(x, x + 3 * W, work + 3 * W * j);
  }
}

void BlockLdlt::solve(double* x) {
  for (std::size_t i = 0; i < rows(); ++i) std::copy(x + 3 * i, x + 3 * i + 3, work_.data() + 3 * place_[i]);
  solveIn<1>(work_.data());
  for (std::size_t i = 0; i < rows(); ++i) {
    std::copy(work_.data() + 3 * place_[i], work_.data() + 3 * place_[i] + 3, x + 3 * i);
  }
}

void BlockLdlt::solveColumns(double* x, std::size_t columns, std::size_t stride) {
  std::size_t c = 0;
  for (; c + 8 <= columns; c += 8) {
    double* first = x + c * stride;
    for (std::size_t i = 0; i < rows(); ++i) {
      double* to = work_.data() + 24 * static_cast<std::size_t>(place_[i]);
      for (std::size_t d = 0; d < 3; ++d)
        for (std::size_t w = 0; w < 8; ++w) to[8 * d + w] = first[w * stride + 3 * i + d];
    }
    solveIn<8>(work_.data());
    for (std::size_t i = 0; i < rows(); ++i) {
      const double* from = work_.data() + 24 * static_cast<std::size_t>(place_[i]);
      for (std::size_t d = 0; d < 3; ++d)
        for (std::size_t w = 0; w < 8; ++w) first[w * stride + 3 * i + d] = from[8 * d + w];
    }
  }
  for (; c < columns; ++c) solve(x + c * stride);
}

}  // namespace vest::fem
