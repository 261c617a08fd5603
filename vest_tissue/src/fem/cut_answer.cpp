#include "vest_tissue/fem/cut_answer.h"

#include <algorithm>
#include <cmath>

namespace vest::fem {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr std::size_t kMostCouplings = 64;  ///< nodes that one knot's elements lead to (assumed)
constexpr double kColumnBytes = 48e6;       ///< of kept answers (assumed)
constexpr double kOpenedBytes = 16e6;       ///< of columns of nodes that cuts laid open (assumed)

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
  const std::size_t rows = static_cast<std::size_t>(
      std::min<double>(std::min(kMostCutKnots, knots), kColumnBytes / (24.0 * std::max(unknowns, 1.0))));
  const std::size_t most = (rows + 1) / 2;  // doubled nodes have two knots or more
  gamma_.resize(most);
  gamma_of_.assign(nodes, -1);
  row_of_.assign(knots, -1);
  row_.resize(rows);
  changed_.resize(rows);
  coupling_.resize(rows * kMostCouplings);
  const auto g = 3 * static_cast<Eigen::Index>(most), c = 3 * static_cast<Eigen::Index>(rows),
             n = static_cast<Eigen::Index>(unknowns);
  // Not set: what no cut has used yet takes no memory.
  columns_.resize(n, g);
  answers_.resize(n, c);
  gamma_factor_.resize(g, g);
  gamma_answer_.resize(g, c);
  half_.resize(c, g);
  own_.resize(c, c);
  factor_.resize(c, c);
  work_.setZero(n), small_.setZero(g), at_cut_.setZero(c);
  touched_of_.assign(knots, -1);
  opened_of_.assign(nodes, -1);
  stride_u_ = c, stride_g_ = g;
  const auto touched = static_cast<Eigen::Index>(std::min(kMostTouched, knots));
  touched_u_.resize(touched * c, 3);
  touched_g_.resize(touched * g, 3);
  const double most_opened = std::min<double>(kMostTouched, kOpenedBytes / (24.0 * std::max(unknowns, 1.0)));
  opened_columns_.resize(n, 3 * static_cast<Eigen::Index>(most_opened));
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

/// F A_IC and A_CC - A_CI F A_IC where something changed, then F_GI A_IC for all. Each entry comes from the
/// later one of its two rows, whichever changed: the same bits however the mesh came about.
void CutAnswer::setAnswers(const TissueModel& t, const TissueState& s, BlockLdlt& factor) {
  const Model& m = *t.model;
  const Material& material = m.description.material;
  const double scale = t.step * (t.step + material.rayleigh_stiffness),
               inertia = 1.0 + t.step * material.rayleigh_mass;
  const auto at = [](std::size_t row) { return 3 * static_cast<Eigen::Index>(row); };
  for (std::size_t r = 0; r < rows_; ++r) {
    if (!changed_[r]) continue;
    own_.block(at(r), 0, 3, at(rows_)).setZero();
    own_.block(0, at(r), at(rows_), 3).setZero();
  }
  for (std::size_t r = 0; r < rows_; ++r) {
    if (!changed_[r]) continue;
    const Index knot = row_[r].knot, o = s.origin[knot];
    own_.block<3, 3>(at(r), at(r)) += inertia * s.mass[knot] * Matrix3d::Identity();
    for (std::size_t k = m.incidence_start[o]; k < m.incidence_start[o + 1]; ++k) {
      const std::uint32_t e = m.incidence[k] / 4;
      const int own = static_cast<int>(m.incidence[k] % 4);
      if (s.corner[e][static_cast<std::size_t>(own)] != knot) continue;
      for (int c = 0; c < 4; ++c) {
        const std::int32_t found = row_of_[s.corner[e][static_cast<std::size_t>(c)]];
        if (found < 0) continue;
        const std::size_t other = static_cast<std::size_t>(found);
        if (other < r && changed_[other]) continue;  // that row has written it
        const std::size_t first = std::min(r, other), last = std::max(r, other);
        const Matrix3d block = scale * stiffnessBlock(m.elements[e], m.laws[e], Matrix3d::Identity(),
                                                      first == r ? own : c, first == r ? c : own);
        own_.block<3, 3>(at(first), at(last)) += block;
      }
    }
  }
  for (std::size_t r = 0; r < rows_;) {
    if (!changed_[r]) {
      ++r;
      continue;
    }
    std::size_t end = r;  // of neighbours that changed, too: solved together
    for (; end < rows_ && changed_[end]; ++end) {
      auto columns = answers_.middleCols<3>(at(end));
      columns.setZero();
      for (std::uint32_t i = row_[end].first; i < row_[end].first + row_[end].count; ++i)
        columns.block<3, 3>(3 * m.unknown[coupling_[i].node], 0) = coupling_[i].block;
    }
    factor.solveColumns(answers_.col(at(r)).data(), 3 * (end - r), static_cast<std::size_t>(answers_.rows()));
    r = end;
  }
  for (std::size_t r = 0; r < rows_; ++r) {
    for (std::size_t l = 0; l <= r; ++l) {
      if (!changed_[r] && !changed_[l]) continue;
      Matrix3d sum = Matrix3d::Zero();
      for (std::uint32_t i = row_[l].first; i < row_[l].first + row_[l].count; ++i)
        sum += coupling_[i].block.transpose() * answers_.block<3, 3>(3 * m.unknown[coupling_[i].node], at(r));
      const Matrix3d block = own_.block<3, 3>(at(l), at(r)) - sum;
      own_.block<3, 3>(at(r), at(l)) = block.transpose();
      if (l != r) own_.block<3, 3>(at(l), at(r)) = block;
    }
  }
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
  touched_ = 0;
  std::fill(touched_of_.begin(), touched_of_.end(), -1);
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

bool CutAnswer::touch(const TissueModel& t, const TissueState& s, BlockLdlt& factor, const Index* knots,
                      std::size_t count) {
  const Model& m = *t.model;
  const auto& number = t.movingNumber();
  const auto inner = [&](Index k) {
    const Index o = s.origin[k];
    return m.unknown[o] >= 0 && row_of_[k] < 0 && number[o] < 0;
  };
  // Where the new ones have no room beside the old ones, these go: what is kept has no bearing on the values.
  std::size_t news = 0, opened = 0;
  for (std::size_t i = 0; i < count; ++i) {
    news += touched_of_[knots[i]] < 0;
    opened += inner(knots[i]) && opened_of_[s.origin[knots[i]]] < 0;
  }
  if (touched_ + news > kMostTouched) {
    touched_ = 0;
    std::fill(touched_of_.begin(), touched_of_.end(), -1);
  }
  const std::size_t room = static_cast<std::size_t>(opened_columns_.cols() / 3);
  if (opened_ + opened > room) {
    opened_ = 0;
    std::fill(opened_of_.begin(), opened_of_.end(), -1);
  }
  const Eigen::Index g = doubledSize(), c = cutSize();
  for (std::size_t i = 0; i < count; ++i) {
    const Index k = knots[i], o = s.origin[k];
    if (inner(k) && opened_of_[o] < 0) {
      if (opened_ == room) return false;
      const auto first = 3 * static_cast<Eigen::Index>(opened_);
      opened_columns_.middleCols<3>(first).setZero();
      opened_columns_.block<3, 3>(3 * m.unknown[o], first).setIdentity();
      factor.solveColumns(opened_columns_.col(first).data(), 3,
                          static_cast<std::size_t>(opened_columns_.rows()));
      opened_of_[o] = static_cast<std::int32_t>(opened_++);
    }
    if (touched_of_[k] >= 0) continue;
    if (touched_ == kMostTouched) return false;
    touched_of_[k] = static_cast<std::int32_t>(touched_++);
    auto u = touched_u_.middleRows(at(k) * stride_u_, c);
    auto v = touched_g_.middleRows(at(k) * stride_g_, g);
    u.setZero(), v.setZero();
    if (m.unknown[o] < 0) continue;
    Eigen::Index from = 0;
    if (row_of_[k] >= 0) {
      from = 3 * row_of_[k];
      u.middleRows<3>(from).setIdentity();
    } else {
      const Eigen::Index own = 3 * m.unknown[o];
      for (Eigen::Index r = 0; r < g; ++r) {
        Eigen::RowVector3d sum = columns_.col(r).segment<3>(own).transpose();
        for (Eigen::Index l = 0; l < r; ++l) sum -= gamma_factor_(r, l) * v.row(l);
        v.row(r) = sum / gamma_factor_(r, r);
      }
      for (Eigen::Index r = 0; r < c; ++r) {
        Eigen::RowVector3d sum = -answers_.col(r).segment<3>(own).transpose();
        for (Eigen::Index l = 0; l < g; ++l) sum += half_(r, l) * v.row(l);
        u.row(r) = sum;
      }
    }
    for (Eigen::Index r = from; r < c; ++r) {
      Eigen::RowVector3d sum = u.row(r);
      for (Eigen::Index l = from; l < r; ++l) sum -= factor_(r, l) * u.row(l);
      u.row(r) = sum / factor_(r, r);
    }
  }
  return true;
}

Matrix3d CutAnswer::whole(const TissueModel& t, const TissueState& s, Index a, Index b) const {
  const Model& m = *t.model;
  const Index oa = s.origin[a], ob = s.origin[b];
  if (m.unknown[oa] < 0 || m.unknown[ob] < 0 || row_of_[a] >= 0 || row_of_[b] >= 0) return Matrix3d::Zero();
  const auto& number = t.movingNumber();
  const std::int32_t ra = number[oa], rb = number[ob];
  if (ra >= 0 && rb >= 0) return t.movingAnswer().block<3, 3>(3 * ra, 3 * rb) / (t.step * t.step);
  // From the column of the inner one; of two, of the first in number.
  const bool by_a = ra < 0 && (rb >= 0 || oa < ob);
  const Index column = by_a ? oa : ob, row = by_a ? ob : oa;
  const Matrix3d block = opened_columns_.block<3, 3>(3 * m.unknown[row], 3 * opened_of_[column]);
  return by_a ? Matrix3d(block.transpose()) : block;
}

}  // namespace vest::fem
