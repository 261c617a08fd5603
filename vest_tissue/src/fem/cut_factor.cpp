#include "vest_tissue/fem/cut_factor.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace vest::fem {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr std::size_t kFill = 2;       ///< room of the factor over the whole object's (assumed)
constexpr double kColumnBytes = 64e6;  ///< of kept columns (assumed)
constexpr double kLine = 1e-9;         ///< sine below which three held knots are in a line (as validate())
constexpr int kPowerSteps = 12;        ///< tuned
constexpr double kMargin = 1.1;        ///< tuned

}  // namespace

CutFactor::CutFactor(const TissueModel& t, std::size_t knots) {
  const Model& m = *t.model;
  order_ = m.free_node;
  std::sort(order_.begin(), order_.end(), [&](Index a, Index b) {
    return t.factor.place(static_cast<std::uint32_t>(m.unknown[a])) <
           t.factor.place(static_cast<std::uint32_t>(m.unknown[b]));
  });
  const std::size_t pairs = 6 * m.elements.size();
  factor_.reserve(knots, pairs, kFill * t.factor.factorBlocks() + 8 * knots);
  pairs_.reserve(pairs);
  place_.reserve(knots);
  copies_.assign(m.mass.size(), 0);
  row_of_.assign(knots, -1);
  touched_of_.assign(knots, -1);
  still_.assign(knots, 0);
  if (t.motion == Motion::Elastostatic) root_.resize(knots), held_.resize(knots);
  const auto unknowns = static_cast<Eigen::Index>(3 * knots);
  work_.setZero(unknowns);
  const double most = std::min<double>(kMostTouched, kColumnBytes / (24.0 * static_cast<double>(unknowns)));
  columns_.resize(unknowns, 3 * static_cast<Eigen::Index>(most));
}

/// Elastostatic: parts with three held knots that are not in a line. Two knots of an element are one part.
void CutFactor::findStill(const TissueModel& t, const TissueState& s) {
  const Model& m = *t.model;
  std::fill(still_.begin(), still_.end(), std::uint8_t{0});
  if (t.motion != Motion::Elastostatic) return;
  for (Index k = 0; k < s.x.size(); ++k) root_[k] = k;
  const auto find = [&](Index k) {
    while (root_[k] != k) k = root_[k] = root_[root_[k]];
    return k;
  };
  for (const auto& corner : s.corner)
    for (int c = 1; c < 4; ++c) {
      const Index a = find(corner[0]), b = find(corner[static_cast<std::size_t>(c)]);
      root_[std::max(a, b)] = std::min(a, b);
    }
  const auto place = [&](Index k) -> const Vector3d& { return m.description.nodes[s.origin[k]]; };
  std::fill(held_.begin(), held_.end(), std::array<Index, 2>{kNoSlot, kNoSlot});
  for (Index k = 0; k < s.x.size(); ++k) {
    const Index root = find(k);
    auto& held = held_[root];
    if (m.unknown[s.origin[k]] >= 0 || still_[root] != 0) continue;
    // Copies of a held knot are no second one.
    if (held[0] == kNoSlot) {
      held[0] = k;
    } else if (held[1] == kNoSlot) {
      if (s.origin[k] != s.origin[held[0]]) held[1] = k;
    } else {
      const Vector3d u = place(held[1]) - place(held[0]), w = place(k) - place(held[0]);
      still_[root] = u.cross(w).norm() > kLine * u.norm() * w.norm();
    }
  }
  for (Index k = 0; k < s.x.size(); ++k) still_[k] = still_[find(k)];
}

bool CutFactor::renew(const TissueModel& t, const TissueState& s) {
  if (made_for_ == std::uint64_t{s.revision} + 1) return usable_;
  const Model& m = *t.model;
  made_for_ = std::uint64_t{s.revision} + 1;
  usable_ = false;
  touched_ = 0;
  std::fill(touched_of_.begin(), touched_of_.end(), -1);
  ++made_;
  // Rows by knot; their places behind those of the knots of all nodes before.
  std::fill(copies_.begin(), copies_.end(), 0u);
  std::uint32_t rows = 0;
  for (std::size_t k = 0; k < s.x.size(); ++k) {
    row_of_[k] = m.unknown[s.origin[k]] < 0 ? -1 : static_cast<std::int32_t>(rows++);
    ++copies_[s.origin[k]];
  }
  std::uint32_t next = 0;
  for (const Index node : order_) next += std::exchange(copies_[node], next);
  place_.resize(rows);
  for (std::size_t k = 0; k < s.x.size(); ++k)
    if (row_of_[k] >= 0) place_[static_cast<std::size_t>(row_of_[k])] = copies_[s.origin[k]]++;
  pairs_.clear();
  for (const auto& corner : s.corner)
    for (const auto& [a, b] : kPairs) {
      const std::int32_t i = row_of_[corner[static_cast<std::size_t>(a)]],
                         j = row_of_[corner[static_cast<std::size_t>(b)]];
      if (i >= 0 && j >= 0 && i != j)
        pairs_.emplace_back(static_cast<std::uint32_t>(i), static_cast<std::uint32_t>(j));
    }
  findStill(t, s);
  usable_ = factor_.reorder(place_, pairs_) && factorise(t, s);
  if (!usable_) std::fill(still_.begin(), still_.end(), std::uint8_t{0});
  return usable_;
}

bool CutFactor::factorise(const TissueModel& t, const TissueState& s) {
  const Model& m = *t.model;
  const Material& material = m.description.material;
  const double h = t.step;
  const auto rowOf = [&](std::size_t e, int corner) {
    return row_of_[s.corner[e][static_cast<std::size_t>(corner)]];
  };
  const auto fill = [&] {
    factor_.setZero();
    for (std::size_t e = 0; e < s.corner.size(); ++e) {
      const double scale = still_[s.corner[e][0]] != 0 ? h * h : h * (h + material.rayleigh_stiffness);
      for (const auto& [a, b] : kPairs) {
        const std::int32_t i = rowOf(e, a), j = rowOf(e, b);
        if (i < 0 || j < 0) continue;
        factor_.add(factor_.slot(static_cast<std::uint32_t>(i), static_cast<std::uint32_t>(j)),
                    scale * stiffnessBlock(m.elements[e], m.laws[e], Matrix3d::Identity(), a, b));
      }
    }
    for (std::size_t k = 0; k < s.x.size(); ++k) {
      if (row_of_[k] < 0 || still_[k] != 0) continue;
      const auto row = static_cast<std::uint32_t>(row_of_[k]);
      factor_.add(factor_.slot(row, row),
                  (1.0 + h * material.rayleigh_mass) * s.mass[k] * Matrix3d::Identity());
    }
    return factor_.factorise();
  };
  if (fill()) return true;
  std::fill(still_.begin(), still_.end(), std::uint8_t{0});
  return t.motion == Motion::Elastostatic && fill();
}

double CutFactor::softest(const TissueModel& t, const TissueState& s) {
  // Power iteration, from below; a tenth above it is the bound (prepareElastostatic()).
  const auto rows = static_cast<Eigen::Index>(3 * factor_.rows());
  auto x = work_.head(rows);
  x.setZero();
  for (std::size_t k = 0; k < s.x.size(); ++k)
    if (row_of_[k] >= 0 && still_[k] != 0) x.segment<3>(3 * row_of_[k]).setOnes();
  double size = std::sqrt(x.squaredNorm()), greatest = 0.0;
  for (int i = 0; i < kPowerSteps && size > 0.0; ++i) {
    x /= size;
    factor_.solve(x.data());
    size = std::sqrt(x.squaredNorm());
    greatest = t.step * t.step * size;
  }
  return kMargin * greatest;
}

void CutFactor::solve(const TissueState& s, const std::vector<Vector3d>& b, std::vector<Vector3d>& x) {
  for (std::size_t k = 0; k < s.x.size(); ++k)
    if (row_of_[k] >= 0) work_.segment<3>(3 * row_of_[k]) = b[k];
  factor_.solve(work_.data());
  for (std::size_t k = 0; k < s.x.size(); ++k)
    x[k] = row_of_[k] < 0 ? Vector3d(Vector3d::Zero()) : Vector3d(work_.segment<3>(3 * row_of_[k]));
}

bool CutFactor::touch(const Index* knots, std::size_t count) {
  const auto room = static_cast<std::size_t>(columns_.cols() / 3);
  std::size_t news = 0;
  for (std::size_t i = 0; i < count; ++i) news += touched_of_[knots[i]] < 0;
  // Where the new ones have no room beside the old ones, these go: what is kept has no bearing on the values.
  if (touched_ + news > room) {
    touched_ = 0;
    std::fill(touched_of_.begin(), touched_of_.end(), -1);
  }
  const std::size_t first = touched_;
  for (std::size_t i = 0; i < count; ++i) {
    const Index k = knots[i];
    if (row_of_[k] < 0 || touched_of_[k] >= 0) continue;
    if (touched_ == room) {  // too many for one step
      for (std::int32_t& at : touched_of_)
        if (at >= static_cast<std::int32_t>(first)) at = -1;
      touched_ = first;
      return false;
    }
    const auto at = 3 * static_cast<Eigen::Index>(touched_);
    columns_.middleCols<3>(at).setZero();
    columns_.block<3, 3>(3 * row_of_[k], at).setIdentity();
    touched_of_[k] = static_cast<std::int32_t>(touched_++);
  }
  factor_.solveColumns(columns_.col(3 * static_cast<Eigen::Index>(first)).data(), 3 * (touched_ - first),
                       static_cast<std::size_t>(columns_.rows()));
  return true;
}

Matrix3d CutFactor::answer(Index a, Index b) const {
  if (row_of_[a] < 0 || row_of_[b] < 0) return Matrix3d::Zero();
  // From one column for both orders.
  if (b > a) return columns_.block<3, 3>(3 * row_of_[a], 3 * touched_of_[b]);
  return columns_.block<3, 3>(3 * row_of_[b], 3 * touched_of_[a]).transpose();
}

}  // namespace vest::fem
