#include "vest_tissue/fem/cut_answer.h"

#include <algorithm>
#include <cmath>

namespace vest::fem {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr std::size_t kMostCouplings = 64;  ///< nodes that one knot's elements lead to (ours)
constexpr double kColumnBytes = 48e6;       ///< of kept columns (ours)

/// Lower Cholesky factor of the leading n × n part, row by row: a row needs those before it alone. From row
/// `first` on, the earlier ones being those of the same matrix.
template <typename Matrix>
bool cholesky(Matrix& m, Eigen::Index first, Eigen::Index n) {
  for (Eigen::Index i = first; i < n; ++i) {
    for (Eigen::Index j = 0; j < i; ++j) {
      m(i, j) = (m(i, j) - m.row(i).head(j).dot(m.row(j).head(j))) / m(j, j);
    }
    const double whole = m(i, i), pivot = whole - m.row(i).head(i).squaredNorm();
    if (!(pivot > 1e-13 * whole) || !std::isfinite(pivot)) return false;
    m(i, i) = std::sqrt(pivot);
  }
  return true;
}

/// x = L^-1 x, then x = L^-T x.
template <typename Matrix, typename Vector>
void forward(const Matrix& l, Eigen::Index n, Vector&& x) {
  for (Eigen::Index i = 0; i < n; ++i) {
    double sum = x[i];
    for (Eigen::Index j = 0; j < i; ++j) sum -= l(i, j) * x[j];
    x[i] = sum / l(i, i);
  }
}
template <typename Matrix, typename Vector>
void backward(const Matrix& l, Eigen::Index n, Vector&& x) {
  for (Eigen::Index i = n; i-- > 0;) {
    x[i] /= l(i, i);
    for (Eigen::Index j = 0; j < i; ++j) x[j] -= l(i, j) * x[i];
  }
}

}  // namespace

CutAnswer::CutAnswer(const TissueModel& t, std::size_t knots) {
  const std::size_t nodes = t.model->mass.size();
  const double unknowns = 3.0 * static_cast<double>(t.model->free_node.size());
  const std::size_t most = static_cast<std::size_t>(std::min<double>(
      static_cast<double>(kMostCutKnots) / 2, kColumnBytes / (24.0 * std::max(unknowns, 1.0))));
  gamma_.resize(most);
  gamma_of_.assign(nodes, -1);
  row_of_.assign(knots, -1);
  row_.resize(kMostCutKnots);
  changed_.resize(kMostCutKnots);
  coupling_.resize(kMostCutKnots * kMostCouplings);
  const auto g = 3 * static_cast<Eigen::Index>(most), c = 3 * static_cast<Eigen::Index>(kMostCutKnots),
             n = static_cast<Eigen::Index>(unknowns);
  columns_.setZero(n, g);
  answers_.setZero(n, 8);
  gamma_factor_.setZero(g, g);
  gamma_answer_.setZero(g, c);
  half_.setZero(c, g);
  own_.setZero(c, c);
  factor_.setZero(c, c);
  work_.setZero(n), small_.setZero(g), at_cut_.setZero(c);
}

/// Doubled nodes and their knots, in the order of the copies: what was there keeps its place.
bool CutAnswer::gather(const TissueModel& t, const TissueState& s) {
  const Model& m = *t.model;
  gammas_ = rows_ = 0;
  std::fill(gamma_of_.begin(), gamma_of_.end(), -1);
  std::fill(row_of_.begin(), row_of_.end(), -1);
  const auto addRow = [&](Index knot) {
    if (rows_ == row_.size()) return false;
    row_of_[knot] = static_cast<std::int32_t>(rows_);
    if (row_[rows_].knot != knot) row_[rows_] = Row{knot, 0, 0, 0, 0};
    ++rows_;
    return true;
  };
  for (std::size_t k = m.mass.size(); k < s.x.size(); ++k) {
    const Index o = s.origin[k];
    if (m.unknown[o] < 0) continue;
    if (gamma_of_[o] < 0) {
      if (gammas_ == gamma_.size()) return false;
      gamma_of_[o] = static_cast<std::int32_t>(gammas_);
      gamma_[gammas_++] = o;
      if (!addRow(o)) return false;
    }
    if (!addRow(static_cast<Index>(k))) return false;
  }
  return true;
}

/// Blocks of A between a row's knot and the other nodes. False: no room.
bool CutAnswer::couple(const TissueModel& t, const TissueState& s, std::size_t number) {
  const Model& m = *t.model;
  const Material& material = m.description.material;
  const double scale = t.step * (t.step + material.rayleigh_stiffness);
  Row& row = row_[number];
  std::uint32_t elements = 0, inner = 0;
  const Index o = s.origin[row.knot];
  for (std::size_t k = m.incidence_start[o]; k < m.incidence_start[o + 1]; ++k) {
    const auto& corner = s.corner[m.incidence[k] / 4];
    if (corner[m.incidence[k] % 4] != row.knot) continue;
    ++elements;
    for (const Index c : corner) inner += gamma_of_[s.origin[c]] >= 0;
  }
  changed_[number] = row.elements != elements || row.inner != inner;
  if (!changed_[number]) return true;
  row.elements = elements, row.inner = inner;
  row.first = static_cast<std::uint32_t>(number * kMostCouplings);
  row.count = 0;
  for (std::size_t k = m.incidence_start[o]; k < m.incidence_start[o + 1]; ++k) {
    const std::uint32_t e = m.incidence[k] / 4;
    const int own = static_cast<int>(m.incidence[k] % 4);
    const auto& corner = s.corner[e];
    if (corner[static_cast<std::size_t>(own)] != row.knot) continue;
    for (int c = 0; c < 4; ++c) {
      const Index node = s.origin[corner[static_cast<std::size_t>(c)]];
      if (c == own || m.unknown[node] < 0 || gamma_of_[node] >= 0) continue;
      std::uint32_t at = 0;
      while (at < row.count && coupling_[row.first + at].node != node) ++at;
      if (at == kMostCouplings) return false;
      Coupling& coupling = coupling_[row.first + at];
      if (at == row.count) coupling.node = node, coupling.block.setZero(), ++row.count;
      coupling.block += scale * stiffnessBlock(m.elements[e], m.laws[e], Matrix3d::Identity(), c, own);
    }
  }
  return true;
}

/// Columns of F of newly doubled nodes; their rows of F_GG's factor follow in renew().
void CutAnswer::setColumns(const TissueModel& t, BlockLdlt& factor, std::size_t first) {
  const Model& m = *t.model;
  const Eigen::Index from = 3 * static_cast<Eigen::Index>(first), to = 3 * static_cast<Eigen::Index>(gammas_);
  for (Eigen::Index c = from; c < to; ++c) {
    columns_.col(c).setZero();
    columns_(3 * m.unknown[gamma_[static_cast<std::size_t>(c / 3)]] + c % 3, c) = 1.0;
  }
  if (to > from)
    factor.solveColumns(columns_.col(from).data(), static_cast<std::size_t>(to - from),
                        static_cast<std::size_t>(columns_.rows()));
}

/// F_GI A_IC for all, and A_CC - A_CI F A_IC for changed rows.
void CutAnswer::setAnswers(const TissueModel& t, const TissueState& s, BlockLdlt& factor) {
  const Model& m = *t.model;
  const Material& material = m.description.material;
  const double scale = t.step * (t.step + material.rayleigh_stiffness),
               inertia = 1.0 + t.step * material.rayleigh_mass;
  const Eigen::Index size = 3 * static_cast<Eigen::Index>(rows_);
  // A_CC of changed rows and columns.
  for (std::size_t r = 0; r < rows_; ++r) {
    if (!changed_[r]) continue;
    const Eigen::Index i = 3 * static_cast<Eigen::Index>(r);
    own_.block(i, 0, 3, size).setZero();
    own_.block(0, i, size, 3).setZero();
  }
  for (std::size_t r = 0; r < rows_; ++r) {
    if (!changed_[r]) continue;
    const Eigen::Index i = 3 * static_cast<Eigen::Index>(r);
    const Row& row = row_[r];
    const Index o = s.origin[row.knot];
    own_.block<3, 3>(i, i) += inertia * s.mass[row.knot] * Matrix3d::Identity();
    for (std::size_t k = m.incidence_start[o]; k < m.incidence_start[o + 1]; ++k) {
      const std::uint32_t e = m.incidence[k] / 4;
      const int own = static_cast<int>(m.incidence[k] % 4);
      if (s.corner[e][static_cast<std::size_t>(own)] != row.knot) continue;
      for (int c = 0; c < 4; ++c) {
        const std::int32_t other = row_of_[s.corner[e][static_cast<std::size_t>(c)]];
        if (other < 0 || (changed_[static_cast<std::size_t>(other)] && static_cast<std::size_t>(other) < r))
          continue;  // both changed: the lesser row has written it
        const Matrix3d block = scale * stiffnessBlock(m.elements[e], m.laws[e], Matrix3d::Identity(), own, c);
        own_.block<3, 3>(i, 3 * other) += block;
        if (static_cast<std::size_t>(other) != r) own_.block<3, 3>(3 * other, i) += block.transpose();
      }
    }
  }
  // F A_IC, eight columns at a time.
  Eigen::Index unknowns[8];
  Eigen::Index count = 0;
  const auto flush = [&] {
    if (count == 0) return;
    factor.solveColumns(answers_.data(), static_cast<std::size_t>(count),
                        static_cast<std::size_t>(answers_.rows()));
    for (Eigen::Index n = 0; n < count; ++n) {
      const Eigen::Index c = unknowns[n];
      for (std::size_t l = 0; l < rows_; ++l) {
        if (changed_[l] && static_cast<Eigen::Index>(l) < c / 3) continue;  // by symmetry: that row's own
        Vector3d sum = Vector3d::Zero();
        for (std::uint32_t i = row_[l].first; i < row_[l].first + row_[l].count; ++i)
          sum +=
              coupling_[i].block.transpose() * answers_.col(n).segment<3>(3 * m.unknown[coupling_[i].node]);
        for (Eigen::Index a = 0; a < 3; ++a) {
          const Eigen::Index at = 3 * static_cast<Eigen::Index>(l) + a;
          if (at / 3 == c / 3) {
            own_(at, c) -= sum[a];
          } else {
            own_(at, c) -= sum[a];
            own_(c, at) -= sum[a];
          }
        }
      }
      answers_.col(n).setZero();
    }
    count = 0;
  };
  answers_.setZero();
  for (std::size_t r = 0; r < rows_; ++r) {
    for (Eigen::Index a = 0; changed_[r] && a < 3; ++a) {
      unknowns[count] = 3 * static_cast<Eigen::Index>(r) + a;
      for (std::uint32_t i = row_[r].first; i < row_[r].first + row_[r].count; ++i)
        answers_.col(count).segment<3>(3 * m.unknown[coupling_[i].node]) = coupling_[i].block.col(a);
      if (++count == 8) flush();
    }
  }
  flush();
  // F_GI A_IC from the kept columns.
  for (std::size_t r = 0; r < rows_; ++r) {
    for (Eigen::Index g = 0; g < 3 * static_cast<Eigen::Index>(gammas_); ++g) {
      Vector3d sum = Vector3d::Zero();
      for (std::uint32_t i = row_[r].first; i < row_[r].first + row_[r].count; ++i)
        sum += coupling_[i].block.transpose() * columns_.col(g).segment<3>(3 * m.unknown[coupling_[i].node]);
      gamma_answer_.block<1, 3>(g, 3 * static_cast<Eigen::Index>(r)) = sum.transpose();
    }
  }
}

bool CutAnswer::renew(const TissueModel& t, const TissueState& s, BlockLdlt& factor) {
  if (revision_ == s.revision) return usable_;
  const Model& m = *t.model;
  const bool anew = revision_ == 0 || !usable_;
  const std::size_t known = anew ? 0 : gammas_;
  if (anew) std::fill(row_.begin(), row_.end(), Row{});
  revision_ = s.revision;
  usable_ = false;
  if (anew)
    for (Row& row : row_) row.knot = static_cast<Index>(row_of_.size());
  if (!gather(t, s)) return false;
  for (std::size_t r = 0; r < rows_; ++r)
    if (!couple(t, s, r)) return false;
  setColumns(t, factor, known);
  const Eigen::Index g = 3 * static_cast<Eigen::Index>(gammas_), c = 3 * static_cast<Eigen::Index>(rows_),
                     from = 3 * static_cast<Eigen::Index>(known);
  for (Eigen::Index i = from; i < g; ++i)
    for (Eigen::Index j = 0; j <= i; ++j)
      gamma_factor_(i, j) = columns_(3 * m.unknown[gamma_[static_cast<std::size_t>(i / 3)]] + i % 3, j);
  if (!cholesky(gamma_factor_, from, g)) return false;
  setAnswers(t, s, factor);
  // S = A_CC - A_CI F A_IC + (F_GI A_IC)^T (F_GG)^-1 F_GI A_IC
  for (Eigen::Index i = 0; i < c; ++i) {
    for (Eigen::Index j = 0; j < g; ++j) half_(i, j) = gamma_answer_(j, i);
    forward(gamma_factor_, g, half_.row(i));
    for (Eigen::Index j = 0; j <= i; ++j)
      factor_(i, j) = own_(i, j) + half_.row(i).head(g).dot(half_.row(j).head(g));
  }
  usable_ = cholesky(factor_, 0, c);
  return usable_;
}

void CutAnswer::solve(const TissueModel& t, const TissueState& s, BlockLdlt& factor,
                      const std::vector<Vector3d>& b, std::vector<Vector3d>& x) {
  const Model& m = *t.model;
  const Eigen::Index g = 3 * static_cast<Eigen::Index>(gammas_), c = 3 * static_cast<Eigen::Index>(rows_);
  const auto load = [&] {
    work_.setZero();
    for (Index n = 0; n < m.mass.size(); ++n)
      if (m.unknown[n] >= 0 && gamma_of_[n] < 0) work_.segment<3>(3 * m.unknown[n]) = b[n];
  };
  const auto atGamma = [&] {  // small = (F_GG)^-1 (F b)_G
    for (std::size_t i = 0; i < gammas_; ++i)
      small_.segment<3>(3 * static_cast<Eigen::Index>(i)) = work_.segment<3>(3 * m.unknown[gamma_[i]]);
    forward(gamma_factor_, g, small_);
    backward(gamma_factor_, g, small_);
  };
  load();
  factor.solve(work_.data());
  atGamma();
  for (std::size_t r = 0; r < rows_; ++r) {
    Vector3d sum = b[row_[r].knot];
    for (std::uint32_t i = row_[r].first; i < row_[r].first + row_[r].count; ++i) {
      const Eigen::Index at = 3 * m.unknown[coupling_[i].node];
      sum -= coupling_[i].block.transpose() * work_.segment<3>(at);
    }
    at_cut_.segment<3>(3 * static_cast<Eigen::Index>(r)) = sum;
  }
  // - A_CI (-F_IG small)
  at_cut_.head(c).noalias() += gamma_answer_.topLeftCorner(g, c).transpose() * small_.head(g);
  forward(factor_, c, at_cut_);
  backward(factor_, c, at_cut_);
  load();
  for (std::size_t r = 0; r < rows_; ++r) {
    const Vector3d own = at_cut_.segment<3>(3 * static_cast<Eigen::Index>(r));
    for (std::uint32_t i = row_[r].first; i < row_[r].first + row_[r].count; ++i)
      work_.segment<3>(3 * m.unknown[coupling_[i].node]) -= coupling_[i].block * own;
  }
  factor.solve(work_.data());
  atGamma();
  work_.noalias() -= columns_.leftCols(g) * small_.head(g);
  for (std::size_t k = 0; k < s.x.size(); ++k) {
    const std::int32_t row = row_of_[k], unknown = m.unknown[s.origin[k]];
    x[k] = unknown < 0 ? Vector3d(Vector3d::Zero())
           : row >= 0  ? Vector3d(at_cut_.segment<3>(3 * static_cast<Eigen::Index>(row)))
                       : Vector3d(work_.segment<3>(3 * unknown));
  }
}

}  // namespace vest::fem
