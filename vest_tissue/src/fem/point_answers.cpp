#include <algorithm>
#include <cmath>

#include "vest_tissue/fem/cut_answer.h"
#include "vest_tissue/fem/tissue.h"

namespace vest::fem {
namespace {

using Eigen::Matrix3d;

bool turns(const TissueModel& t) {
  return t.model->description.strain == Strain::Corotational;
}

/// m/N, of a whole object.
Matrix3d wholeAnswer(const TissueModel& t, const TissueState& s, const TissueScratch& w, Index a, Index b) {
  const Index oa = s.origin[a], ob = s.origin[b];
  if (t.model->unknown[oa] < 0 || t.model->unknown[ob] < 0) return Matrix3d::Zero();
  const auto& number = s.dynamic ? t.movingNumber() : t.answer_number;
  const std::int32_t ra = number[oa], rb = number[ob];
  Matrix3d D = Matrix3d::Zero();
  if (ra >= 0 && rb >= 0) {
    D = (s.dynamic ? t.movingAnswer() : t.answer).block<3, 3>(3 * ra, 3 * rb);
    if (turns(t)) D = w.rotation[s.knot_element[a]] * D * w.rotation[s.knot_element[b]].transpose();
  }
  // Where the cut is too long for the update of the answers: a copy, or an inner knot that a cut laid open,
  // can also move by itself.
  const bool alone = s.revision > 0 && (ra < 0 || a != oa || s.mass[a] < 0.999 * t.model->mass[oa]);
  if (a == b && alone) D += (t.step * t.step * t.loose_inverse[oa]) * Matrix3d::Identity();
  return D;
}

/// u and g of the knots of each point, with their weights. False: no room for the cut.
bool touchAll(const TissueModel& t, const TissueState& s, TissueScratch& w) {
  if (!w.cut || !w.cut->renew(t, s, w.factor)) return false;
  std::array<Index, kMostTouched> knots;
  std::size_t count = 0;
  for (const TissuePoint& point : w.points)
    for (int a = 0; a < 3; ++a)
      if (point.weights[a] != 0.0) knots[count++] = point.knots[a];
  if (!w.cut->touch(t, s, w.factor, knots.data(), count)) return false;
  const bool turning = turns(t);
  const Eigen::Index rows_u = w.cut->cutSize(), rows_g = w.cut->doubledSize();
  for (std::size_t p = 0; p < w.points.size(); ++p) {
    auto u = w.point_u.middleRows(static_cast<Eigen::Index>(p) * rows_u, rows_u);
    auto g = w.point_g.middleRows(static_cast<Eigen::Index>(p) * rows_g, rows_g);
    u.setZero(), g.setZero();
    for (int a = 0; a < 3; ++a) {
      const double weight = w.points[p].weights[a];
      if (weight == 0.0) continue;
      const Index k = w.points[p].knots[a];
      Matrix3d back = Matrix3d::Identity();
      if (turning) back = w.rotation[s.knot_element[k]].transpose();
      back *= weight;
      const auto own_u = w.cut->u(k);
      const auto own_g = w.cut->g(k);
      for (Eigen::Index r = 0; r < rows_u; ++r) u.row(r) += own_u.row(r) * back;
      for (Eigen::Index r = 0; r < rows_g; ++r) g.row(r) += own_g.row(r) * back;
    }
  }
  return true;
}

/// Sum over the rows, one by one: the same bits whatever else is asked.
template <typename Columns>
Matrix3d product(const Columns& all, std::size_t p, std::size_t q, Eigen::Index rows) {
  Matrix3d sum = Matrix3d::Zero();
  const Eigen::Index first = static_cast<Eigen::Index>(p) * rows,
                     second = static_cast<Eigen::Index>(q) * rows;
  for (Eigen::Index r = 0; r < rows; ++r) sum += all.row(first + r).transpose() * all.row(second + r);
  return sum;
}

}  // namespace

void answerPoints(const TissueModel& t, const TissueState& s, double h, TissueScratch& w) {
  const std::size_t count = w.points.size();
  const double ratio = h / t.step;
  const double scale = s.dynamic ? std::min(1.0, ratio * ratio) : 1.0 / s.stiffness_scale;
  const bool updated = s.x.size() > t.model->mass.size() && touchAll(t, s, w), turning = turns(t);
  const double square = t.step * t.step;
  for (std::size_t p = 0; p < count; ++p) {
    for (std::size_t q = 0; q <= p; ++q) {
      Matrix3d sum = Matrix3d::Zero();
      for (int a = 0; a < 3; ++a) {
        if (w.points[p].weights[a] == 0.0) continue;
        for (int b = 0; b < 3; ++b) {
          const double weight = w.points[p].weights[a] * w.points[q].weights[b];
          if (weight == 0.0) continue;
          const Index ka = w.points[p].knots[a], kb = w.points[q].knots[b];
          if (!updated) {
            sum += weight * wholeAnswer(t, s, w, ka, kb);
            continue;
          }
          Matrix3d D = (weight * square) * w.cut->whole(t, s, ka, kb);
          if (turning) D = w.rotation[s.knot_element[ka]] * D * w.rotation[s.knot_element[kb]].transpose();
          sum += D;
        }
      }
      if (updated) {
        sum += square *
               (product(w.point_u, p, q, w.cut->cutSize()) - product(w.point_g, p, q, w.cut->doubledSize()));
      }
      sum *= scale;
      w.answers[p * kMostTissuePoints + q] = sum;
      w.answers[q * kMostTissuePoints + p] = sum.transpose();
    }
  }
}

}  // namespace vest::fem
