#include "vest_tissue/fem/cut_factor.h"

#include <algorithm>
#include <numeric>

namespace vest::fem {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr std::size_t kFill = 2;       ///< room of the factor over the whole object's (assumed)
constexpr double kColumnBytes = 64e6;  ///< of kept columns (assumed)

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
  const auto unknowns = static_cast<Eigen::Index>(3 * knots);
  work_.setZero(unknowns);
  const double most = std::min<double>(kMostTouched, kColumnBytes / (24.0 * static_cast<double>(unknowns)));
  columns_.resize(unknowns, 3 * static_cast<Eigen::Index>(most));
}

bool CutFactor::renew(const TissueModel& t, const TissueState& s) {
  if (revision_ == s.revision) return usable_;
  const Model& m = *t.model;
  const Material& material = m.description.material;
  revision_ = s.revision;
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
  const auto rowOf = [&](std::size_t e, int corner) {
    return row_of_[s.corner[e][static_cast<std::size_t>(corner)]];
  };
  pairs_.clear();
  for (std::size_t e = 0; e < s.corner.size(); ++e)
    for (const auto& [a, b] : kPairs) {
      const std::int32_t i = rowOf(e, a), j = rowOf(e, b);
      if (i >= 0 && j >= 0 && i != j)
        pairs_.emplace_back(static_cast<std::uint32_t>(i), static_cast<std::uint32_t>(j));
    }
  if (!factor_.reorder(place_, pairs_)) return false;
  const double scale = t.step * (t.step + material.rayleigh_stiffness),
               inertia = 1.0 + t.step * material.rayleigh_mass;
  for (std::size_t e = 0; e < s.corner.size(); ++e)
    for (const auto& [a, b] : kPairs) {
      const std::int32_t i = rowOf(e, a), j = rowOf(e, b);
      if (i < 0 || j < 0) continue;
      factor_.add(factor_.slot(static_cast<std::uint32_t>(i), static_cast<std::uint32_t>(j)),
                  scale * stiffnessBlock(m.elements[e], m.laws[e], Matrix3d::Identity(), a, b));
    }
  for (std::size_t k = 0; k < s.x.size(); ++k) {
    if (row_of_[k] < 0) continue;
    const auto row = static_cast<std::uint32_t>(row_of_[k]);
    factor_.add(factor_.slot(row, row), inertia * s.mass[k] * Matrix3d::Identity());
  }
  usable_ = factor_.factorise();
  return usable_;
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
